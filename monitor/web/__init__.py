"""The pages and the HTTP interface of ``monitor serve``: a request of the contract in, its answer out; no computation."""
