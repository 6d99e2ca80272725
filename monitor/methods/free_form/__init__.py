"""A workpiece of unknown shape, probed at several angles."""
