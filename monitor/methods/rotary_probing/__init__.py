"""A piece touched at indexed angles of rotary axes."""
