"""SAMBA: balls and a scale bar, touched at indexed angles."""
