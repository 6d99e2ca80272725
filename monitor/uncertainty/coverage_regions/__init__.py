"""Coverage factors and regions for one and for many quantities."""
