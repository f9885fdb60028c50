"""Error measures between a reference sequence and a decoded one."""
