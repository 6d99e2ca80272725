"""One response over its inputs: no machine at all."""
