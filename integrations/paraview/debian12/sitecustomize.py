"""Python plug-ins in Debian 12's ParaView 5.11, which uses ``inspect.getargspec``; its Python 3.11 has that no longer.

Put this folder on PYTHONPATH before ParaView starts. Later versions of ParaView do not need it.
"""

import inspect

if not hasattr(inspect, "getargspec"):
    inspect.getargspec = inspect.getfullargspec
