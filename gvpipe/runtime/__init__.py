"""What compiled loops rest on: where their machine code is kept, and in what form."""
