"""The pages: each file has the routes of one, asks questions of the contract and renders its template."""
