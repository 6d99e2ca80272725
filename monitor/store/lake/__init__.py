"""Many plants, one view: a DuckLake that the databases of plants publish to, and that is read as one of them is.

``attaching`` opens a lake, ``schema`` makes its tables and views, ``names`` tells plants and their names apart,
``copying`` says which rows go with which entries of an audit, ``publication`` adds what a plant stored since,
``reading`` answers the questions of one database from all plants.
"""
