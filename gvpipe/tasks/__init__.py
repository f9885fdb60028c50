"""Work elsewhere: in processes of this machine (`processes`), or on a Dask cluster (`cluster`).

Both answer `Executor.run`. What goes there is a function by name, data as bytes, and tasks that pickle.
"""
