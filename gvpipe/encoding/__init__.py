"""What ``gvpipe.encode`` does: what was asked for, where frames come from, one sequence or the shots of a capture."""
