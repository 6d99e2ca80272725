"""Effects that a plan cannot tell apart: rivals, distances between effects, poses that would separate them."""
