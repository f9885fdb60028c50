"""The numbered claims of the codecs' papers, measured here."""
