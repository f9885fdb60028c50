"""Mutated files for every parser, with checksums repaired: no crash, no hang, nothing infinite, no cost beyond the budget.

    python -m fuzz --seconds 600

A case is a seed file that was taken apart, changed at a few places, and put together again. So what it breaks is behind the
checksums, where a stranger's file can break it too. The same ``--seed`` gives the same cases.

`seeds` makes the seed files, `mutation` changes bytes, `videos` and `mesh_files` take files apart, `limits` judges a case,
`worker` and `session` run many, `reduction` makes one small.
"""
