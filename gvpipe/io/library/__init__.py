"""Processes of their own for libraries that damaged files or full disks can crash."""
