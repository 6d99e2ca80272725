"""The colours of everything that is drawn, and the width it may take; nothing here needs a drawing library."""

#: Relative luminances 0.02, 0.25, 0.68, 0.88, 0.07 and 0.22: blue and orange differ in grey as well as in colour,
#: and wherever two series meet they differ in marker or line style too.
INK = "#22262b"
MID = "#858b93"
PALE = "#d3d7dc"
FAINT = "#f1f2f4"
BLUE = "#1d4e7c"
ORANGE = "#cc6420"
#: The text width of an A4 page with margins of 17 mm.
PAGE_WIDTH_MM = 176.0
