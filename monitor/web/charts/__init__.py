"""Charts as plotly.js reads them: data and layout as a document, colours by the names of the style sheet ("@blue")."""
