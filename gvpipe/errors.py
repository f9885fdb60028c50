"""The exceptions that gvpipe raises, under their public name. `gvpipe.foundation.errors` describes the tree."""

from __future__ import annotations

from gvpipe.foundation.errors import CorruptFile as CorruptFile
from gvpipe.foundation.errors import FormatError as FormatError
from gvpipe.foundation.errors import GvpipeError as GvpipeError
from gvpipe.foundation.errors import InputError as InputError
from gvpipe.foundation.errors import MissingSection as MissingSection
from gvpipe.foundation.errors import NewerVersion as NewerVersion
from gvpipe.foundation.errors import NotGeometryVideo as NotGeometryVideo
from gvpipe.foundation.errors import OutputError as OutputError
from gvpipe.foundation.errors import OverBudget as OverBudget
from gvpipe.foundation.errors import SettingError as SettingError
from gvpipe.foundation.errors import SeveralShots as SeveralShots
from gvpipe.foundation.errors import StrippedFile as StrippedFile
from gvpipe.foundation.errors import TopologyChange as TopologyChange
from gvpipe.foundation.errors import TruncatedFile as TruncatedFile
