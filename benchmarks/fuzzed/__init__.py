"""Inputs to fuzz palpate's readers with: valid examples, how they are damaged, what reads them."""
