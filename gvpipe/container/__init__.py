"""The file: sections and header of a bitstream, and the MP4 file that holds them."""
