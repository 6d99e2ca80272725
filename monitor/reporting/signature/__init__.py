"""Electronic signatures of certificates."""
