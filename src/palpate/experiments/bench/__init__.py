"""`palpate bench`: speed against error, one study per topic, all in one report."""
