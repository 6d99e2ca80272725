"""The formats that can be read: one file a format, registered by its ``READER``."""
