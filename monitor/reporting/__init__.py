"""Numbers on paper, figures and certificates: what was computed elsewhere, printed and never recomputed."""
