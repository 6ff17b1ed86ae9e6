"""Who may drive what listens here: whoever has its token, which the printed address carries, as Jupyter's does."""

import hmac
import secrets


def new_token() -> str:
    """Return 256 random bits as text that fits into an address."""
    return secrets.token_urlsafe(32)


def is_token(given: object, token: str) -> bool:
    """Return whether `given` is the token, in a time that does not depend on where the two differ."""
    return isinstance(given, str) and hmac.compare_digest(given.encode(errors="replace"), token.encode())
