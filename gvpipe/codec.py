"""What a package that adds a codec needs, under its public name. `gvpipe.coding.codec` is the contract."""

from __future__ import annotations

from gvpipe.coding.codec import BaseCodec as BaseCodec
from gvpipe.coding.codec import ClosableReader as ClosableReader
from gvpipe.coding.codec import Codec as Codec
from gvpipe.coding.codec import Encoded as Encoded
from gvpipe.coding.codec import FrameReader as FrameReader
from gvpipe.coding.codec import GroupReader as GroupReader
from gvpipe.coding.codec import LevelReader as LevelReader
from gvpipe.coding.codec import LiveCoder as LiveCoder
from gvpipe.coding.codec import Memo as Memo
from gvpipe.coding.codec import Settings as Settings
from gvpipe.container.bitstream import Bitstream as Bitstream
