"""Files as instruments and controllers write them: one file a format, registered by its ``EXPORT``."""
