"""The pages and the HTTP interface of ``monitor serve``: requests of the contract in, answers out; no computation."""
