"""The report of a study: a document of plain blocks, and two writers that turn it into HTML and PDF."""
