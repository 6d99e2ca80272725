"""The way from a campaign folder to trends and a certificate: the only room that knows all the others.

One file a step. Every function takes the open database first and returns the JSON document of that step, in
display units with the unit in the key or beside the number; the faces print it.
"""
