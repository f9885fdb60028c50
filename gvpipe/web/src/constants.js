// Made by tools/web_constants.py from gvpipe's Python modules; edit those, and run it again.

// gvpipe.asset_coding.directory
export const DIRECTORY_SECTION = "asset";
export const DIRECTORY_VERSION = 1;
export const DIRECTORY_MOST = 65536;
export const DIRECTORY_MAX_BYTES = 67108864;
export const DIRECTORY_SURFACE = 2;
export const DIRECTORY_OCTAHEDRAL = 3;
export const DIRECTORY_REDUCED = 4;

// gvpipe.asset_coding.encoder
export const ENCODER_ARRANGEMENT = "arrangement";
export const ENCODER_CODED = 1;

// gvpipe.asset_coding.times
export const TIMES_SECTION = "times";

// gvpipe.asset_coding.volume_list
export const VOLUME_LIST_SECTION = "volume";
export const VOLUME_LIST_CELLS = "volume.cells";
export const VOLUME_LIST_ORDER = "volume.order";
export const VOLUME_LIST_POINTS = "volume.points";
export const VOLUME_LIST_VERSION = 2;
export const VOLUME_LIST_IN_ORDER = 0;
export const VOLUME_LIST_BY_WALK = 1;
export const VOLUME_LIST_BY_CORNERS = 2;
export const VOLUME_LIST_MAX_BYTES = 16777216;
export const VOLUME_LIST_MOST_CELLS = 1073741824;
export const VOLUME_LIST_MOST_POINTS = 16777216;

// gvpipe.asset_coding.volume_reader
export const VOLUME_READER_BYTES_PER_CELL = 1200;
export const VOLUME_READER_SECONDS_PER_CELL = 6e-06;
export const VOLUME_READER_BYTES_PER_POINT = 700;
export const VOLUME_READER_SECONDS_PER_POINT = 8e-06;

// gvpipe.attributes.linear_kernels
export const LINEAR_KERNELS_AFFINE = 4;
export const LINEAR_KERNELS_PARALLELOGRAM = 2;

// gvpipe.attributes.match_kernels
export const MATCH_KERNELS_N_MATCH_CONTEXTS = 9;
export const MATCH_KERNELS_N_RESIDUAL_CONTEXTS = 16;

// gvpipe.attributes.octahedral_kernels
export const OCTAHEDRAL_KERNELS_MEAN = 1;
export const OCTAHEDRAL_KERNELS_PLACE = 3;
export const OCTAHEDRAL_KERNELS_PLACE_CORRECTED = 5;
export const OCTAHEDRAL_KERNELS_SURFACE = 2;

// gvpipe.attributes.part_kernels
export const PART_KERNELS_N_PART_CONTEXTS = 3;

// gvpipe.attributes.polygon_kernels
export const POLYGON_KERNELS_N_CONTEXTS = 32;

// gvpipe.attributes.sharing_kernels
export const SHARING_KERNELS_N_CONTEXTS = 12;

// gvpipe.attributes.value_coding
export const VALUE_CODING_MAX_SHIFT = 32;

// gvpipe.connectivity.adaptive_mesh
export const ADAPTIVE_MESH_MAX_POINTS = 32768;

// gvpipe.connectivity.adaptive_order
export const ADAPTIVE_ORDER_MAX_VERTICES = 65536;

// gvpipe.connectivity.candidate_kernels
export const CANDIDATE_KERNELS_N_CONTEXTS = 7;
export const CANDIDATE_KERNELS_N_GROUPS = 5;
export const CANDIDATE_KERNELS_NUMBER_CONTEXTS = 4;
export const CANDIDATE_KERNELS_NUMBER_GROUPS = 2;

// gvpipe.connectivity.candidate_order
export const CANDIDATE_ORDER_MARK = 255;
export const CANDIDATE_ORDER_MAX_VERTICES = 65536;

// gvpipe.connectivity.base_mesh
export const BASE_MESH_DRACO_PREFIX = [68, 82, 65, 67, 79, 2, 2, 1, 1, 0, 0];
export const BASE_MESH_MAX_PER_BYTE = 1024;

// gvpipe.connectivity.cell_kernels
export const CELL_KERNELS_N_CONTEXTS = 526;

// gvpipe.connectivity.cell_middles
export const CELL_MIDDLES_MIDDLES = new Map([[24, [10, [[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]]]], [25, [12, [[0, 1], [1, 2], [2, 3], [0, 3], [4, 5], [5, 6], [6, 7], [4, 7], [0, 4], [1, 5], [2, 6], [3, 7]]]], [26, [13, [[0, 1], [1, 2], [0, 2], [3, 4], [4, 5], [3, 5], [0, 3], [1, 4], [2, 5]]]], [27, [14, [[0, 1], [1, 2], [2, 3], [0, 3], [0, 4], [1, 4], [2, 4], [3, 4]]]], [29, [12, [[0, 1], [1, 2], [2, 3], [0, 3], [4, 5], [5, 6], [6, 7], [4, 7], [0, 4], [1, 5], [2, 6], [3, 7], [0, 4, 7, 3], [1, 2, 6, 5], [0, 1, 5, 4], [3, 7, 6, 2], [0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 2, 3, 4, 5, 6, 7]]]]]);

// gvpipe.connectivity.cell_traversal
export const CELL_TRAVERSAL_KEEPS = 1;
export const CELL_TRAVERSAL_RANKED = 2;

// gvpipe.connectivity.cell_poses
export const CELL_POSES_KINDS = [10, 12, 13, 14];
export const CELL_POSES_MOST_POSES = 24;
export const CELL_POSES_MOST_NODES = 8;
export const CELL_POSES_MOST_FACES = 6;

// gvpipe.connectivity.edge_seam_kernels
export const EDGE_SEAM_KERNELS_CONTEXTS = 0;
export const EDGE_SEAM_KERNELS_DECODE = 2;

// gvpipe.connectivity.fitted_kernels
export const FITTED_KERNELS_N_CONTEXTS = 6;
export const FITTED_KERNELS_N_GROUPS = 3;

// gvpipe.connectivity.order_kernels
export const ORDER_KERNELS_N_CONTEXTS = 7;
export const ORDER_KERNELS_N_GROUPS = 3;

// gvpipe.connectivity.position_kernels
export const POSITION_KERNELS_N_CONTEXTS = 8;
export const POSITION_KERNELS_N_GROUPS = 9;

// gvpipe.connectivity.vertex_order
export const VERTEX_ORDER_REACH = 256;
export const VERTEX_ORDER_MAX_VERTICES = 16777215;

// gvpipe.connectivity.visit_symbols
export const VISIT_SYMBOLS_N_SYMBOLS = 19;

// gvpipe.connectivity.welded_mesh
export const WELDED_MESH_ADAPTIVE_MESH = 1;
export const WELDED_MESH_ADAPTIVE_ORDER = 2;
export const WELDED_MESH_FITTED_MESH = 4;

// gvpipe.container.bare
export const BARE_MAGIC = [103, 118, 98, 97, 114, 101, 13, 10];
export const BARE_DICTIONARY = [34, 111, 114, 105, 103, 105, 110, 34, 58, 91, 48, 46, 48, 44, 34, 112, 114, 101, 100, 105, 99, 116, 111, 114, 34, 58, 34, 108, 115, 112, 34, 44, 34, 110, 97, 118, 103, 34, 44, 34, 119, 101, 105, 103, 104, 116, 115, 34, 58, 34, 100, 101, 108, 116, 97, 95, 112, 114, 101, 100, 105, 99, 116, 105, 111, 110, 34, 58, 116, 114, 117, 101, 44, 34, 97, 110, 99, 104, 111, 114, 115, 34, 58, 34, 112, 114, 111, 102, 105, 108, 101, 34, 58, 34, 106, 112, 101, 103, 34, 44, 34, 104, 50, 54, 52, 45, 49, 48, 34, 44, 34, 111, 117, 116, 108, 105, 101, 114, 115, 34, 58, 116, 114, 117, 101, 44, 34, 104, 97, 108, 118, 101, 115, 34, 44, 34, 99, 104, 97, 114, 116, 115, 34, 44, 34, 97, 102, 102, 105, 110, 101, 34, 44, 123, 34, 99, 111, 100, 101, 99, 34, 58, 34, 108, 97, 112, 108, 97, 99, 105, 97, 110, 34, 44, 34, 118, 101, 114, 115, 105, 111, 110, 34, 58, 49, 44, 123, 34, 99, 111, 100, 101, 99, 34, 58, 34, 112, 100, 99, 116, 34, 44, 34, 118, 101, 114, 115, 105, 111, 110, 34, 58, 49, 44, 34, 99, 111, 110, 116, 97, 105, 110, 101, 114, 34, 58, 123, 34, 118, 105, 100, 101, 111, 95, 99, 114, 99, 51, 50, 34, 58, 49, 44, 34, 116, 114, 97, 99, 107, 95, 99, 114, 99, 51, 50, 34, 58, 50, 125, 44, 34, 112, 108, 97, 99, 101, 109, 101, 110, 116, 34, 58, 34, 116, 105, 108, 101, 115, 34, 44, 34, 112, 114, 111, 102, 105, 108, 101, 34, 58, 34, 104, 50, 54, 52, 45, 56, 34, 44, 34, 98, 108, 111, 99, 107, 34, 58, 49, 54, 44, 34, 119, 105, 100, 116, 104, 34, 58, 52, 56, 44, 34, 104, 101, 105, 103, 104, 116, 34, 58, 56, 48, 44, 34, 114, 101, 115, 105, 100, 117, 97, 108, 95, 115, 116, 101, 112, 34, 58, 49, 101, 45, 48, 53, 44, 34, 97, 115, 115, 101, 116, 34, 58, 34, 115, 116, 105, 108, 108, 34, 58, 34, 104, 111, 108, 100, 115, 34, 58, 34, 97, 110, 99, 104, 111, 114, 115, 46, 48, 34, 58, 34, 100, 101, 108, 116, 97, 115, 46, 48, 34, 58, 34, 99, 108, 105, 112, 46, 48, 34, 58, 34, 99, 104, 97, 114, 116, 115, 34, 58, 34, 112, 105, 120, 101, 108, 115, 34, 58, 123, 34, 99, 111, 100, 101, 99, 34, 58, 34, 109, 99, 103, 118, 34, 44, 34, 118, 101, 114, 115, 105, 111, 110, 34, 58, 49, 44, 34, 102, 114, 97, 109, 101, 115, 34, 58, 51, 50, 44, 34, 118, 101, 114, 116, 105, 99, 101, 115, 34, 58, 34, 102, 112, 115, 34, 58, 50, 52, 46, 48, 44, 34, 115, 101, 116, 116, 105, 110, 103, 115, 34, 58, 123, 34, 112, 114, 101, 100, 105, 99, 116, 105, 111, 110, 34, 58, 34, 98, 108, 101, 110, 100, 101, 100, 34, 44, 34, 99, 108, 117, 115, 116, 101, 114, 115, 34, 58, 49, 44, 34, 115, 101, 103, 109, 101, 110, 116, 115, 34, 58, 49, 44, 34, 98, 97, 115, 101, 34, 58, 91, 45, 48, 46, 48, 44, 34, 116, 114, 97, 110, 115, 102, 111, 114, 109, 95, 115, 116, 101, 112, 34, 58, 48, 46, 48, 48, 44, 34, 112, 105, 99, 116, 117, 114, 101, 115, 34, 58, 102, 97, 108, 115, 101, 125, 44, 34, 115, 101, 99, 116, 105, 111, 110, 115, 34, 58, 123, 34, 109, 101, 115, 104, 34, 58, 49, 44, 34, 111, 114, 100, 101, 114, 34, 58, 49, 44, 34, 119, 101, 105, 103, 104, 116, 115, 34, 58, 50, 44, 34, 116, 114, 97, 110, 115, 102, 111, 114, 109, 115, 46, 48, 34, 58, 123, 34, 99, 111, 100, 101, 99, 34, 58, 34, 112, 99, 97, 34, 44, 34, 118, 101, 114, 115, 105, 111, 110, 34, 58, 49, 44, 34, 102, 114, 97, 109, 101, 115, 34, 58, 49, 54, 44, 34, 118, 101, 114, 116, 105, 99, 101, 115, 34, 58, 50, 48, 48, 48, 44, 34, 116, 114, 105, 97, 110, 103, 108, 101, 115, 34, 58, 52, 48, 48, 48, 44, 34, 102, 112, 115, 34, 58, 51, 48, 46, 48, 44, 34, 115, 101, 116, 116, 105, 110, 103, 115, 34, 58, 123, 34, 112, 114, 101, 100, 105, 99, 116, 111, 114, 34, 58, 34, 107, 97, 108, 109, 97, 110, 34, 44, 34, 98, 101, 116, 97, 34, 58, 49, 46, 56, 44, 34, 115, 101, 103, 109, 101, 110, 116, 115, 34, 58, 49, 44, 34, 115, 116, 101, 112, 115, 34, 58, 91, 48, 46, 48, 48, 93, 125, 44, 34, 115, 101, 99, 116, 105, 111, 110, 115, 34, 58, 123, 34, 109, 101, 115, 104, 34, 58, 44, 34, 111, 114, 100, 101, 114, 34, 58, 44, 34, 98, 97, 115, 105, 115, 46, 48, 34, 58, 44, 34, 99, 111, 101, 102, 102, 105, 99, 105, 101, 110, 116, 115, 46, 48, 34, 58, 44, 34, 99, 111, 114, 114, 101, 99, 116, 105, 111, 110, 115, 34, 58, 125, 125];
export const BARE_WITH_SHARED = 2;

// gvpipe.container.bitstream
export const BITSTREAM_MAGIC = [103, 118, 112, 105, 112, 101, 13, 10];
export const BITSTREAM_VERSION = 1;
export const BITSTREAM_MAX_SECTIONS = 4096;
export const BITSTREAM_MAX_NAME = 64;
export const BITSTREAM_MAX_HEADER = 1048576;
export const BITSTREAM_MAX_FRAMES = 16777216;
export const BITSTREAM_MAX_VERTICES = 268435456;

// gvpipe.container.compact_header
export const COMPACT_HEADER_MAX_LENGTH = 1099511627776;

// gvpipe.container.mp4
export const MP4_BOX_UUID = [106, 31, 12, 82, 61, 123, 78, 14, 156, 85, 103, 228, 240, 167, 209, 185];
export const MP4_MAX_BOXES = 65536;

// gvpipe.container.plain
export const PLAIN_VERSION = 2;
export const PLAIN_MOST_VERSIONS = 32;
export const PLAIN_DICTIONARY = [34, 111, 114, 105, 103, 105, 110, 34, 58, 91, 48, 46, 48, 44, 34, 99, 111, 109, 112, 97, 110, 105, 111, 110, 115, 34, 58, 91, 123, 34, 107, 105, 110, 100, 34, 58, 34, 115, 111, 117, 110, 100, 34, 44, 34, 98, 121, 116, 101, 115, 34, 58, 49, 44, 34, 99, 114, 99, 51, 50, 34, 58, 49, 44, 34, 116, 114, 97, 107, 95, 99, 114, 99, 51, 50, 34, 58, 49, 44, 34, 99, 111, 100, 101, 99, 34, 58, 34, 97, 97, 99, 34, 44, 34, 111, 112, 117, 115, 34, 44, 34, 114, 97, 116, 101, 34, 58, 52, 56, 48, 48, 48, 44, 34, 99, 104, 97, 110, 110, 101, 108, 115, 34, 58, 50, 44, 34, 115, 116, 97, 114, 116, 34, 58, 48, 46, 48, 125, 93, 44, 34, 112, 111, 108, 121, 103, 111, 110, 115, 34, 58, 91, 52, 44, 34, 116, 101, 120, 116, 117, 114, 101, 34, 44, 34, 112, 114, 101, 100, 105, 99, 116, 111, 114, 34, 58, 34, 108, 115, 112, 34, 44, 34, 110, 97, 118, 103, 34, 44, 34, 114, 98, 102, 34, 44, 34, 119, 101, 105, 103, 104, 116, 115, 34, 44, 34, 98, 108, 111, 99, 107, 34, 58, 56, 44, 34, 112, 114, 111, 102, 105, 108, 101, 34, 58, 34, 106, 112, 101, 103, 34, 44, 34, 104, 50, 54, 52, 45, 49, 48, 34, 44, 34, 111, 117, 116, 108, 105, 101, 114, 115, 34, 58, 116, 114, 117, 101, 44, 34, 112, 108, 97, 99, 101, 109, 101, 110, 116, 34, 58, 34, 104, 97, 108, 118, 101, 115, 34, 44, 34, 99, 104, 97, 114, 116, 115, 34, 44, 34, 97, 102, 102, 105, 110, 101, 34, 44, 34, 116, 114, 97, 110, 115, 102, 111, 114, 109, 34, 58, 34, 107, 108, 116, 34, 44, 34, 102, 105, 110, 101, 110, 101, 115, 115, 34, 58, 51, 44, 34, 99, 111, 109, 112, 111, 110, 101, 110, 116, 115, 34, 58, 91, 49, 44, 34, 108, 105, 118, 101, 34, 58, 34, 97, 115, 115, 101, 116, 34, 58, 49, 44, 34, 99, 111, 114, 114, 101, 99, 116, 105, 111, 110, 115, 34, 58, 49, 44, 34, 104, 111, 108, 100, 115, 34, 58, 49, 44, 34, 97, 110, 99, 104, 111, 114, 115, 46, 48, 34, 58, 49, 44, 34, 100, 101, 108, 116, 97, 115, 46, 48, 34, 58, 49, 44, 34, 99, 108, 105, 112, 46, 48, 34, 58, 49, 44, 34, 116, 114, 97, 106, 101, 99, 116, 111, 114, 105, 101, 115, 46, 48, 34, 58, 49, 44, 34, 112, 105, 120, 101, 108, 115, 34, 58, 49, 44, 34, 111, 117, 116, 108, 105, 101, 114, 115, 34, 58, 49, 44, 34, 97, 118, 101, 114, 97, 103, 101, 34, 58, 49, 44, 34, 98, 97, 115, 105, 115, 46, 49, 34, 58, 49, 44, 34, 99, 111, 101, 102, 102, 105, 99, 105, 101, 110, 116, 115, 46, 49, 34, 58, 49, 44, 34, 116, 114, 97, 110, 115, 102, 111, 114, 109, 115, 46, 49, 34, 58, 49, 44, 34, 115, 101, 116, 116, 105, 110, 103, 115, 34, 58, 123, 34, 99, 108, 105, 112, 115, 34, 58, 49, 44, 34, 98, 97, 115, 101, 34, 58, 91, 45, 48, 46, 49, 44, 34, 115, 101, 116, 116, 105, 110, 103, 115, 34, 58, 123, 34, 111, 112, 101, 114, 97, 116, 111, 114, 34, 58, 34, 109, 101, 97, 110, 45, 118, 97, 108, 117, 101, 34, 44, 34, 100, 101, 108, 116, 97, 95, 112, 114, 101, 100, 105, 99, 116, 105, 111, 110, 34, 58, 34, 107, 97, 108, 109, 97, 110, 34, 44, 34, 97, 110, 99, 104, 111, 114, 115, 34, 58, 49, 54, 44, 34, 97, 110, 99, 104, 111, 114, 95, 99, 104, 111, 105, 99, 101, 34, 58, 34, 104, 105, 101, 114, 97, 114, 99, 104, 121, 34, 44, 34, 101, 100, 103, 101, 95, 112, 111, 119, 101, 114, 34, 58, 48, 46, 55, 53, 44, 34, 97, 118, 101, 114, 97, 103, 101, 95, 115, 116, 101, 112, 34, 58, 48, 46, 48, 54, 50, 53, 44, 34, 97, 110, 99, 104, 111, 114, 95, 114, 97, 116, 105, 111, 34, 58, 49, 46, 50, 44, 34, 98, 97, 115, 105, 115, 95, 114, 97, 116, 105, 111, 34, 58, 50, 46, 48, 44, 34, 115, 101, 103, 109, 101, 110, 116, 115, 34, 58, 49, 44, 34, 115, 116, 101, 112, 115, 34, 58, 91, 48, 46, 48, 44, 123, 34, 99, 111, 100, 101, 99, 34, 58, 34, 108, 97, 112, 108, 97, 99, 105, 97, 110, 34, 44, 34, 118, 101, 114, 115, 105, 111, 110, 34, 58, 49, 44, 34, 102, 114, 97, 109, 101, 115, 34, 58, 123, 34, 99, 111, 100, 101, 99, 34, 58, 34, 112, 100, 99, 116, 34, 44, 34, 118, 101, 114, 115, 105, 111, 110, 34, 58, 49, 44, 34, 102, 114, 97, 109, 101, 115, 34, 58, 93, 44, 34, 116, 114, 105, 97, 110, 103, 108, 101, 115, 34, 58, 91, 49, 93, 44, 34, 108, 101, 118, 101, 108, 115, 34, 58, 91, 49, 50, 52, 44, 34, 102, 112, 115, 34, 58, 50, 52, 46, 48, 44, 34, 111, 117, 116, 108, 105, 110, 101, 34, 58, 123, 34, 98, 111, 120, 34, 58, 91, 45, 48, 46, 49, 44, 34, 102, 112, 115, 34, 58, 51, 48, 46, 48, 44, 34, 111, 117, 116, 108, 105, 110, 101, 34, 58, 123, 34, 98, 111, 120, 34, 58, 91, 45, 49, 46, 48, 44, 45, 48, 46, 53, 93, 44, 34, 116, 114, 97, 110, 115, 102, 111, 114, 109, 95, 115, 116, 101, 112, 34, 58, 48, 46, 48, 48, 93, 44, 34, 112, 108, 97, 99, 101, 109, 101, 110, 116, 34, 58, 34, 116, 105, 108, 101, 115, 34, 44, 34, 112, 114, 111, 102, 105, 108, 101, 34, 58, 34, 104, 50, 54, 52, 45, 56, 34, 44, 34, 98, 108, 111, 99, 107, 34, 58, 49, 54, 44, 34, 119, 105, 100, 116, 104, 34, 58, 52, 56, 44, 34, 104, 101, 105, 103, 104, 116, 34, 58, 56, 48, 44, 34, 116, 114, 97, 110, 115, 102, 111, 114, 109, 95, 115, 116, 101, 112, 34, 58, 48, 46, 48, 48, 44, 34, 114, 101, 115, 105, 100, 117, 97, 108, 95, 115, 116, 101, 112, 34, 58, 48, 46, 48, 48, 44, 34, 112, 105, 99, 116, 117, 114, 101, 115, 34, 58, 102, 97, 108, 115, 101, 125, 44, 34, 115, 101, 99, 116, 105, 111, 110, 115, 34, 58, 123, 34, 109, 101, 115, 104, 34, 58, 49, 44, 34, 111, 114, 100, 101, 114, 34, 58, 49, 44, 34, 115, 116, 105, 108, 108, 34, 58, 49, 44, 34, 119, 101, 105, 103, 104, 116, 115, 34, 58, 50, 44, 34, 116, 114, 97, 110, 115, 102, 111, 114, 109, 115, 46, 48, 34, 58, 49, 44, 34, 99, 104, 97, 114, 116, 115, 34, 58, 49, 125, 125, 123, 34, 99, 111, 100, 101, 99, 34, 58, 34, 109, 99, 103, 118, 34, 44, 34, 118, 101, 114, 115, 105, 111, 110, 34, 58, 49, 44, 34, 102, 114, 97, 109, 101, 115, 34, 58, 51, 50, 44, 34, 118, 101, 114, 116, 105, 99, 101, 115, 34, 58, 49, 48, 48, 44, 34, 116, 114, 105, 97, 110, 103, 108, 101, 115, 34, 58, 50, 48, 48, 44, 34, 102, 112, 115, 34, 58, 51, 48, 46, 48, 44, 34, 111, 117, 116, 108, 105, 110, 101, 34, 58, 123, 34, 98, 111, 120, 34, 58, 91, 45, 48, 46, 48, 93, 125, 44, 34, 115, 101, 116, 116, 105, 110, 103, 115, 34, 58, 123, 34, 112, 114, 101, 100, 105, 99, 116, 105, 111, 110, 34, 58, 34, 98, 108, 101, 110, 100, 101, 100, 34, 44, 34, 99, 108, 117, 115, 116, 101, 114, 115, 34, 58, 49, 44, 34, 115, 101, 103, 109, 101, 110, 116, 115, 34, 58, 49, 44, 34, 98, 97, 115, 101, 34, 58, 91, 45, 48, 46, 48, 123, 34, 99, 111, 100, 101, 99, 34, 58, 34, 112, 99, 97, 34, 44, 34, 118, 101, 114, 115, 105, 111, 110, 34, 58, 49, 44, 34, 102, 114, 97, 109, 101, 115, 34, 58, 49, 48, 48, 44, 34, 118, 101, 114, 116, 105, 99, 101, 115, 34, 58, 50, 48, 48, 48, 44, 34, 116, 114, 105, 97, 110, 103, 108, 101, 115, 34, 58, 52, 48, 48, 48, 44, 34, 102, 112, 115, 34, 58, 51, 48, 46, 48, 44, 34, 111, 117, 116, 108, 105, 110, 101, 34, 58, 123, 34, 98, 111, 120, 34, 58, 91, 45, 48, 46, 48, 44, 34, 108, 101, 118, 101, 108, 115, 34, 58, 91, 49, 44, 53, 51, 93, 125, 44, 34, 115, 101, 116, 116, 105, 110, 103, 115, 34, 58, 123, 34, 112, 114, 101, 100, 105, 99, 116, 111, 114, 34, 58, 34, 107, 97, 108, 109, 97, 110, 34, 44, 34, 98, 101, 116, 97, 34, 58, 49, 46, 56, 44, 34, 115, 101, 103, 109, 101, 110, 116, 115, 34, 58, 49, 44, 34, 115, 116, 101, 112, 115, 34, 58, 91, 48, 46, 48, 48, 93, 125, 44, 34, 115, 101, 99, 116, 105, 111, 110, 115, 34, 58, 123, 34, 109, 101, 115, 104, 34, 58, 49, 44, 34, 111, 114, 100, 101, 114, 34, 58, 49, 44, 34, 98, 97, 115, 105, 115, 46, 48, 34, 58, 49, 44, 34, 99, 111, 101, 102, 102, 105, 99, 105, 101, 110, 116, 115, 46, 48, 34, 58, 49, 125, 125];

// gvpipe.container.segments
export const SEGMENTS_TINY = 1e-60;
export const SEGMENTS_HUGE = 1e+39;
export const SEGMENTS_SMALLEST_STEP = 3.6734198463196485e-40;
export const SEGMENTS_LARGEST_STEP = 6.80564733841877e+38;
export const SEGMENTS_MAX_SEGMENT = 100000;

// gvpipe.container.live_layout
export const LIVE_LAYOUT_HEAD_BYTES = 24;
export const LIVE_LAYOUT_LIVE_UUID = [213, 240, 177, 200, 106, 30, 76, 87, 159, 67, 43, 122, 144, 196, 232, 97];

// gvpipe.container.shared_sections
export const SHARED_SECTIONS_MAX_SHARED = 268435456;

// gvpipe.container.shot_layout
export const SHOT_LAYOUT_MAGIC = [103, 118, 115, 104, 111, 116, 115, 10];
export const SHOT_LAYOUT_MAX_SHOTS = 65536;
export const SHOT_LAYOUT_MAX_HEADER = 4194304;
export const SHOT_LAYOUT_MAX_BYTES = 1099511627776;
export const SHOT_LAYOUT_MAX_POSTER = 4294967296;
export const SHOT_LAYOUT_FARTHEST = 1e+39;

// gvpipe.container.stream_layout
export const STREAM_LAYOUT_INDEX_UUID = [60, 10, 126, 53, 143, 13, 74, 134, 155, 14, 31, 91, 143, 31, 111, 82];
export const STREAM_LAYOUT_ROOM_UUID = [60, 10, 126, 53, 143, 13, 74, 134, 155, 14, 31, 91, 143, 31, 111, 83];
export const STREAM_LAYOUT_SHOTS_UUID = [60, 10, 126, 53, 143, 13, 74, 134, 155, 14, 31, 91, 143, 31, 111, 84];
export const STREAM_LAYOUT_DATA_UUID = [185, 198, 209, 164, 82, 231, 79, 59, 138, 85, 13, 110, 124, 47, 154, 49];
export const STREAM_LAYOUT_MAX_INDEX = 33554432;

// gvpipe.coding.corrections.displacements
export const DISPLACEMENTS_MAX_POSITIONS = 1048576;
export const DISPLACEMENTS_NEAR = 3;

// gvpipe.entropy.block_coder
export const BLOCK_CODER_PARAMETRIC = 1;

// gvpipe.entropy.decision_kernels
export const DECISION_KERNELS_ONE_BITS = 22;
export const DECISION_KERNELS_SEEN_BITS = 8;
export const DECISION_KERNELS_AHEAD = 3;
export const DECISION_KERNELS_PLACE = 2;
export const DECISION_KERNELS_RANGE = 4294967295;

// gvpipe.entropy.forecast_kernels
export const FORECAST_KERNELS_N_FORECASTS = 2;

// gvpipe.entropy.integers
export const INTEGERS_MAX_CONTEXTS = 65536;

// gvpipe.entropy.logistic_tables
export const LOGISTIC_TABLES_LIMIT = 2815;
export const LOGISTIC_TABLES_SPACING = 16;
export const LOGISTIC_TABLES_KNOTS = [280, 298, 317, 337, 359, 382, 407, 433, 461, 491, 523, 557, 593, 631, 672, 715, 761, 810, 863, 918, 977, 1041, 1108, 1179, 1255, 1336, 1422, 1514, 1612, 1716, 1826, 1944, 2070, 2203, 2345, 2497, 2658, 2829, 3011, 3206, 3412, 3633, 3867, 4116, 4382, 4664, 4965, 5285, 5626, 5988, 6375, 6786, 7223, 7689, 8184, 8712, 9274, 9871, 10508, 11185, 11906, 12673, 13490, 14359, 15284, 16269, 17317, 18433, 19621, 20885, 22230, 23661, 25185, 26807, 28533, 30370, 32325, 34405, 36619, 38976, 41483, 44152, 46991, 50013, 53228, 56650, 60290, 64164, 68285, 72670, 77335, 82299, 87579, 93196, 99171, 105527, 112287, 119477, 127125, 135257, 143906, 153102, 162881, 173277, 184330, 196079, 208568, 221842, 235948, 250938, 266864, 283785, 301758, 320848, 341120, 362645, 385496, 409751, 435492, 462804, 491777, 522506, 555090, 589632, 626241, 665029, 706114, 749620, 795674, 844407, 895959, 950469, 1008086, 1068960, 1133245, 1201101, 1272689, 1348174, 1427725, 1511509, 1599698, 1692462, 1789971, 1892392, 1999893, 2112633, 2230769, 2354451, 2483819, 2619005, 2760128, 2907293, 3060592, 3220097, 3385864, 3557924, 3736288, 3920942, 4111844, 4308925, 4512088, 4721202, 4936108, 5156611, 5382488, 5613479, 5849294, 6089612, 6334081, 6582319, 6833920, 7088451, 7345459, 7604471, 7865001, 8126549, 8388608];

// gvpipe.entropy.number_kernels
export const NUMBER_KERNELS_SLOT_BITS = 16;
export const NUMBER_KERNELS_MIXERS = 4;

// gvpipe.entropy.parametric_tables
export const PARAMETRIC_TABLES_N_TOKENS = 40;
export const PARAMETRIC_TABLES_RATIO_BITS = 12;
export const PARAMETRIC_TABLES_RATIOS = [240, 455, 646, 819, 1047, 1365, 1712, 2048, 2223, 2393, 2571, 2730, 2882, 3030, 3159, 3276, 3383, 3480, 3565, 3640, 3705, 3763, 3812, 3855, 3922, 3971, 4007, 4032, 4051, 4064];
export const PARAMETRIC_TABLES_TOTAL = 1048576;
export const PARAMETRIC_TABLES_ZEROS = 256;

// gvpipe.entropy.range_decoder
export const RANGE_DECODER_PRECISION = 24;

// gvpipe.entropy.series
export const SERIES_MAX_CLASS = 63;
export const SERIES_FIRST_CLASS = 63;

// gvpipe.entropy.tokens
export const TOKENS_DIRECT = 16;
export const TOKENS_TABLE_TOTAL = 4096;
export const TOKENS_MAX_TOKENS = 88;

// gvpipe.foundation.errors
export const ERRORS_REMEDY = "get the file again from its source";

// gvpipe.fields.derived
export const DERIVED_MAGNITUDE = 1;
export const DERIVED_SIGNALS = [6, 1];

// gvpipe.fields.graph
export const GRAPH_MOST_RING = 12;
export const GRAPH_MOST_BEYOND = 8;
export const GRAPH_MOST_WAVES = 200;
export const GRAPH_RING_VARIANCE = 0.3;
export const GRAPH_FAR_VARIANCE = 0.1;
export const GRAPH_SURE = 512.0;
export const GRAPH_LEAST = 0.05;

// gvpipe.fields.head
export const HEAD_MAX_VALUES = 16777216;
export const HEAD_VERSION = 1;

// gvpipe.fields.prediction
export const PREDICTION_TUNINGS = [[[0.15, 1.5, 0.25, 0.05, 0.2], [0.05, 0.3, 1.0, 0.3, 0.05]], [[0.15, 0.03, 0.12, 0.1, 0.9], [0.05, 0.01, 1.35, 0.05, 0.12]]];

// gvpipe.fields.prediction_kernels
export const PREDICTION_KERNELS_STEPS = 0;
export const PREDICTION_KERNELS_WHOLE = 1;
export const PREDICTION_KERNELS_FLOATS = 2;
export const PREDICTION_KERNELS_N_FILTERS = 2;
export const PREDICTION_KERNELS_N_SHARED = 5;

// gvpipe.fields.residual_kernels
export const RESIDUAL_KERNELS_N_CONTEXTS = 7;
export const RESIDUAL_KERNELS_N_FINE = 64;
export const RESIDUAL_KERNELS_N_COARSE = 16;
export const RESIDUAL_KERNELS_NODES = 256;
export const RESIDUAL_KERNELS_N_MIXERS = 64;

// gvpipe.fields.segment
export const SEGMENT_EXACT = 0;
export const SEGMENT_TRAJECTORIES = 2;
export const SEGMENT_DERIVED = 3;
export const SEGMENT_TUNED = 4;

// gvpipe.fields.values
export const VALUES_MAX_COMPONENTS = 256;

// gvpipe.grids.cells
export const CELLS_VOLUMES = new Map([[10, [[0, 1, 3], [1, 2, 3], [2, 0, 3], [0, 2, 1]]], [11, [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]], [12, [[0, 4, 7, 3], [1, 2, 6, 5], [0, 1, 5, 4], [3, 7, 6, 2], [0, 3, 2, 1], [4, 5, 6, 7]]], [13, [[0, 1, 2], [3, 5, 4], [0, 3, 4, 1], [1, 4, 5, 2], [2, 5, 3, 0]]], [14, [[0, 3, 2, 1], [0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]], [15, [[0, 4, 3, 2, 1], [5, 6, 7, 8, 9], [0, 1, 6, 5], [1, 2, 7, 6], [2, 3, 8, 7], [3, 4, 9, 8], [4, 0, 5, 9]]], [16, [[0, 5, 4, 3, 2, 1], [6, 7, 8, 9, 10, 11], [0, 1, 7, 6], [1, 2, 8, 7], [2, 3, 9, 8], [3, 4, 10, 9], [4, 5, 11, 10], [5, 0, 6, 11]]], [24, [[0, 4, 1, 8, 3, 7], [1, 5, 2, 9, 3, 8], [2, 6, 0, 7, 3, 9], [0, 6, 2, 5, 1, 4]]], [25, [[0, 16, 4, 15, 7, 19, 3, 11], [1, 9, 2, 18, 6, 13, 5, 17], [0, 8, 1, 17, 5, 12, 4, 16], [3, 19, 7, 14, 6, 18, 2, 10], [0, 11, 3, 10, 2, 9, 1, 8], [4, 12, 5, 13, 6, 14, 7, 15]]], [26, [[0, 6, 1, 7, 2, 8], [3, 11, 5, 10, 4, 9], [0, 12, 3, 9, 4, 13, 1, 6], [1, 13, 4, 10, 5, 14, 2, 7], [2, 14, 5, 11, 3, 12, 0, 8]]], [27, [[0, 8, 3, 7, 2, 6, 1, 5], [0, 5, 1, 10, 4, 9], [1, 6, 2, 11, 4, 10], [2, 7, 3, 12, 4, 11], [3, 8, 0, 9, 4, 12]]], [29, [[0, 16, 4, 15, 7, 19, 3, 11], [1, 9, 2, 18, 6, 13, 5, 17], [0, 8, 1, 17, 5, 12, 4, 16], [3, 19, 7, 14, 6, 18, 2, 10], [0, 11, 3, 10, 2, 9, 1, 8], [4, 12, 5, 13, 6, 14, 7, 15]]], [31, [[0, 6, 1, 7, 2, 8], [3, 11, 5, 10, 4, 9], [0, 3, 9, 4, 1, 6], [1, 4, 10, 5, 2, 7], [2, 5, 11, 3, 0, 8]]], [32, [[0, 6, 1, 7, 2, 8], [3, 11, 5, 10, 4, 9], [0, 12, 3, 9, 4, 13, 1, 6], [1, 13, 4, 10, 5, 14, 2, 7], [2, 14, 5, 11, 3, 12, 0, 8]]], [33, [[0, 16, 4, 15, 7, 19, 3, 11], [1, 9, 2, 18, 6, 13, 5, 17], [0, 8, 1, 17, 5, 12, 4, 16], [3, 19, 7, 14, 6, 18, 2, 10], [0, 11, 3, 10, 2, 9, 1, 8], [4, 12, 5, 13, 6, 14, 7, 15]]], [37, [[0, 8, 3, 7, 2, 6, 1, 5], [0, 5, 1, 10, 4, 9], [1, 6, 2, 11, 4, 10], [2, 7, 3, 12, 4, 11], [3, 8, 0, 9, 4, 12]]], [71, [[0, 1, 3], [1, 2, 3], [2, 0, 3], [0, 2, 1]]], [72, [[0, 4, 7, 3], [1, 2, 6, 5], [0, 1, 5, 4], [3, 7, 6, 2], [0, 3, 2, 1], [4, 5, 6, 7]]], [73, [[0, 1, 2], [3, 5, 4], [0, 3, 4, 1], [1, 4, 5, 2], [2, 5, 3, 0]]], [74, [[0, 3, 2, 1], [0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]], [78, [[0, 1, 3], [1, 2, 3], [2, 0, 3], [0, 2, 1]]], [79, [[0, 4, 7, 3], [1, 2, 6, 5], [0, 1, 5, 4], [3, 7, 6, 2], [0, 3, 2, 1], [4, 5, 6, 7]]], [80, [[0, 1, 2], [3, 5, 4], [0, 3, 4, 1], [1, 4, 5, 2], [2, 5, 3, 0]]], [81, [[0, 3, 2, 1], [0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]]]);
export const CELLS_SIZES = new Map([[1, 1], [3, 2], [5, 3], [8, 4], [9, 4], [10, 4], [11, 8], [12, 8], [13, 6], [14, 5], [15, 10], [16, 12], [21, 3], [22, 6], [23, 8], [24, 10], [25, 20], [26, 15], [27, 13], [28, 9], [29, 27], [30, 6], [31, 12], [32, 18], [33, 24], [34, 7], [35, 4], [37, 19]]);

// gvpipe.media.video
export const VIDEO_MAX_SIDE = 16384;
export const VIDEO_PROFILES = new Map([["h264-8", {"name": "h264-8", "codec": "h264", "pixel_format": "yuv420p", "depth": 8, "low": 16, "high": 235}], ["h264-10", {"name": "h264-10", "codec": "h264", "pixel_format": "yuv420p10le", "depth": 10, "low": 64, "high": 940}], ["jpeg", {"name": "jpeg", "codec": "mjpeg", "pixel_format": "gray", "depth": 8, "low": 0, "high": 255}]]);

// gvpipe.mesh.hierarchy
export const HIERARCHY_MAX_WAVES = 64;
export const HIERARCHY_PEAK_PER_VERTEX = 120;
export const HIERARCHY_PEAK_PER_TRIANGLE = 230;
export const HIERARCHY_KEPT_PER_VERTEX = 60;
export const HIERARCHY_KEPT_PER_TRIANGLE = 180;
export const HIERARCHY_SECONDS_PER_VERTEX = 1e-06;
export const HIERARCHY_SECONDS_PER_TRIANGLE = 2e-06;

// gvpipe.model.warp
export const WARP_USUAL = ["displacement", "displacements", "disp", "displ", "u", "depl"];

// gvpipe.rasterizer.colormaps
export const COLORMAPS_MAGMA = "\n000004 030311 0a0822 130d33 1d1146 28115a 36106a 430f76 50127c 5d177f 691c81 762181 822681 8f2a81 9c2e7f a9327d b63779 c33b75\ncf4170 db486a e65163 ee5c5e f5695c f9785d fb8761 fd9668 fea571 feb47b fec387 fed194 fde0a2 fceeb0 fcfdbf\n";
export const COLORMAPS_VIRIDIS = "\n440154 470d60 48186a 482374 472d7b 453681 424086 3f4989 3b528b 375a8d 33638d 2f6a8e 2c728e 297a8e 26818e 23898e 21908c 1f988b\n1f9f88 21a685 28ae80 31b57b 3ebc74 4cc26c 5dc963 6ece58 82d34c 96d83f abdc32 c0df24 d5e21a eae51a fde725\n";

// gvpipe.coding.repeated_frames
export const REPEATED_FRAMES_SECTION = "holds";

// gvpipe.trajectory.basis
export const BASIS_MAX_COMPONENTS = 16384;
export const BASIS_MAX_SCALE = 512;
export const BASIS_PER_OCTAVE = 8;
export const BASIS_LEAST_OUTSIDE = 0.2;
export const BASIS_BYTES_PER_VALUE = 40;
export const BASIS_SECONDS_PER_VALUE = 3e-07;
export const BASIS_BYTES_PER_ROW = 520;

// gvpipe.trajectory.coefficient_coding
export const COEFFICIENT_CODING_MAX_VALUES = 134217728;
export const COEFFICIENT_CODING_MOST_FLAGS = 15;

// gvpipe.trajectory.contexts
export const CONTEXTS_PER_OCTAVE = 16;
export const CONTEXTS_MAX_LEVEL = 160;
export const CONTEXTS_N_CONTEXTS = 27;
export const CONTEXTS_TREND_POWERS = [[], [6, 6, 4, 7, 9, -2, 11], [11, 3, 4, 2, 9, -4, 4], [11, 5, 1, 4, 2, 12, 4]];

// gvpipe.trajectory.prediction
export const PREDICTION_PREDICTORS = ["navg", "lsp", "rbf", "kalman"];

// gvpipe.trajectory.still_points
export const STILL_POINTS_SECTION = "still";
export const STILL_POINTS_BYTES_PER_STILL = 240;
export const STILL_POINTS_SECONDS_PER_STILL = 1e-06;
export const STILL_POINTS_SECONDS_PER_PRODUCT = 1e-09;

// gvpipe.trajectory.temporal_neighbours
export const TEMPORAL_NEIGHBOURS_MAX_NEIGHBOURS = 6;
export const TEMPORAL_NEIGHBOURS_MORE_NEIGHBOURS = 8;
export const TEMPORAL_NEIGHBOURS_VARIANCE = 0.02;
export const TEMPORAL_NEIGHBOURS_MORE_VARIANCE = 0.3;
export const TEMPORAL_NEIGHBOURS_MIN_BLOCK = 48;
export const TEMPORAL_NEIGHBOURS_CUBIC = new Map([[-3, -0.0625], [-1, 0.5625], [1, 0.5625], [3, -0.0625]]);
export const TEMPORAL_NEIGHBOURS_LINEAR = new Map([[-1, 0.5], [1, 0.5]]);
export const TEMPORAL_NEIGHBOURS_OFFSETS = [-1, 1, -3, 3, -2, -5, 5, -4];

// gvpipe.trajectory.spatial_neighbours
export const SPATIAL_NEIGHBOURS_PEAK_PER_VERTEX = 520;
export const SPATIAL_NEIGHBOURS_PEAK_PER_TRIANGLE = 40;
export const SPATIAL_NEIGHBOURS_SECONDS_PER_VERTEX = 2e-06;
export const SPATIAL_NEIGHBOURS_SECONDS_PER_TRIANGLE = 1e-06;

// gvpipe.trajectory.trellis
export const TRELLIS_FINENESS = 0.65625;
export const TRELLIS_PARTS = 16;
export const TRELLIS_ZEROS = [[255, 255, 254, 252, 247, 242, 235, 224, 206, 184, 152, 118, 88, 66, 49, 35, 26, 19, 14, 10, 8, 7, 6, 5, 4, 3, 2], [255, 254, 249, 240, 226, 211, 193, 172, 146, 119, 90, 69, 51, 37, 28, 20, 15, 11, 8, 7, 5, 4, 4, 3, 2, 2, 1]];
export const TRELLIS_SHAPES = [0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 2, 4, 6, 8, 10, 12, 14, 17, 19, 21, 23, 24, 25, 26, 27, 28, 29];
export const TRELLIS_TREND_ZEROS = [[255, 254, 252, 249, 243, 236, 228, 213, 190, 163, 130, 101, 77, 58, 43, 32, 24, 17, 12, 9, 7, 5, 4, 4, 3, 3, 2], [254, 246, 238, 224, 207, 185, 159, 134, 108, 83, 66, 50, 39, 28, 21, 15, 12, 9, 6, 5, 4, 3, 2, 2, 2, 2, 1]];
export const TRELLIS_TREND_SHAPES = [0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 3, 5, 6, 8, 10, 13, 15, 18, 20, 22, 23, 25, 26, 27, 27, 28, 29];
export const TRELLIS_GRADES = 1;
export const TRELLIS_FINDS_NOISES = 2;
export const TRELLIS_WHAT = 2;
export const TRELLIS_FALL = 0.96;
export const TRELLIS_LEAST_GRADE = 0.625;

// gvcodecs.laplacian.average_coding
export const LAPLACIAN_AVERAGE_CODING_NAME = "average";
export const LAPLACIAN_AVERAGE_CODING_SPACING = 256;
export const LAPLACIAN_AVERAGE_CODING_FARTHEST = 1000000000.0;

// gvcodecs.laplacian.anchors
export const LAPLACIAN_ANCHORS_ANCHOR_CHOICES = ["hierarchy", "walk"];

// gvcodecs.laplacian.delta_rows
export const LAPLACIAN_DELTA_ROWS_DELTA_PREDICTIONS = ["kalman", "rigid", "none"];
export const LAPLACIAN_DELTA_ROWS_N_CAUSAL = new Map([["kalman", 20], ["rigid", 15], ["none", 0]]);
export const LAPLACIAN_DELTA_ROWS_N_RING = new Map([["kalman", 6], ["rigid", 15], ["none", 0]]);

// gvcodecs.laplacian.header
export const LAPLACIAN_HEADER_MAX_SEGMENTS = 1300;
export const LAPLACIAN_HEADER_VERSION = 1;
export const LAPLACIAN_HEADER_MAX_SPACING = 1048576;
export const LAPLACIAN_HEADER_LEAST_RATIO = 0.0009765625;
export const LAPLACIAN_HEADER_MOST_RATIO = 1024.0;
export const LAPLACIAN_HEADER_FINEST = 9.5367431640625e-07;
export const LAPLACIAN_HEADER_COARSEST = 1.0;
export const LAPLACIAN_HEADER_MOST_POWER = 2.0;

// gvcodecs.laplacian.laplace_operators
export const LAPLACIAN_LAPLACE_OPERATORS_OPERATORS = ["mean-value", "cotangent", "tutte"];

// gvcodecs.laplacian.normal_equations
export const LAPLACIAN_NORMAL_EQUATIONS_COLUMNS = 32;
export const LAPLACIAN_NORMAL_EQUATIONS_FREE_PRODUCTS = 134217728;
export const LAPLACIAN_NORMAL_EQUATIONS_PRODUCTS = 512;
export const LAPLACIAN_NORMAL_EQUATIONS_BYTES_PER_PAIR = 20;
export const LAPLACIAN_NORMAL_EQUATIONS_SECONDS_PER_PAIR = 1.5e-08;
export const LAPLACIAN_NORMAL_EQUATIONS_BYTES_PER_ENTRY = 12;
export const LAPLACIAN_NORMAL_EQUATIONS_SECONDS_PER_ENTRY = 2e-08;
export const LAPLACIAN_NORMAL_EQUATIONS_SECONDS_PER_PRODUCT = 1.4e-09;
export const LAPLACIAN_NORMAL_EQUATIONS_SECONDS_PER_STEP = 6e-09;
export const LAPLACIAN_NORMAL_EQUATIONS_SECONDS_PER_SOLVED = 5e-10;

// gvcodecs.mcgv.base.surface
export const SURFACE_STILL = "still";

// gvcodecs.mcgv.header
export const HEADER_VERSION = 1;
export const HEADER_OF_PICTURES = ["placement", "profile", "block", "width", "height", "residual_step"];
export const HEADER_MAX_FINENESS = 256;
export const HEADER_PREDICTIONS = ["blended", "affine"];
export const HEADER_PLACEMENTS = ["halves", "charts", "tiles"];
export const HEADER_MAX_CLUSTERS = 1024;
export const HEADER_MAX_SEGMENTS = 65536;

// gvcodecs.mcgv.layout.chart_coding
export const CHART_CODING_CONTEXTS = 5;

// gvcodecs.mcgv.layout.chart_kernels
export const CHART_KERNELS_MAX_NEAR = 8;

// gvcodecs.mcgv.layout.coding
export const CODING_CONTEXTS = 4;

// gvcodecs.mcgv.layout.directions
export const DIRECTIONS_COMMON = 90;

// gvcodecs.mcgv.layout.kd_tree
export const KD_TREE_FRAME = 4;
export const KD_TREE_MOMENT_BITS = 10;
export const KD_TREE_SPREAD = 2;
export const KD_TREE_MAX_COORDINATE = 1048576;

// gvcodecs.mcgv.motion.blend_kernels
export const BLEND_KERNELS_FLAT = 1e-06;
export const BLEND_KERNELS_LEAST_ENERGY = 1e-09;

// gvcodecs.mcgv.motion.row_neighbours
export const ROW_NEIGHBOURS_MOST = 8;
export const ROW_NEIGHBOURS_VARIANCE = 0.003;

// gvcodecs.mcgv.motion.skinning
export const SKINNING_INFLUENCES = 4;
export const SKINNING_TOTAL = 64;

// gvcodecs.mcgv.motion.skinning_coding
export const SKINNING_CODING_PREDICTED = 0;

// gvcodecs.mcgv.motion.weight_coding
export const WEIGHT_CODING_COUNT_CONTEXTS = 4;

// gvcodecs.mcgv.motion.weight_kernels
export const WEIGHT_KERNELS_MAX_LISTED = 32;

// gvcodecs.mcgv.pictures.trajectories
export const TRAJECTORIES_PLANES = 3;

// gvcodecs.mcgv.decoding.trajectory_reader
export const TRAJECTORY_READER_BYTES_PER_SAMPLE = 48;
export const TRAJECTORY_READER_SECONDS_PER_SAMPLE = 1e-07;

// gvcodecs.pca.coefficients
export const PCA_COEFFICIENTS_MOST_FIRST = 16;
export const PCA_COEFFICIENTS_FIRST_STEP = 0.9;

// gvcodecs.pca.header
export const PCA_HEADER_MAX_SEGMENTS = 2000;
export const PCA_HEADER_VERSION = 1;

// gvcodecs.pdct.clip
export const PDCT_CLIP_MAX_CLUSTERS = 1024;
export const PDCT_CLIP_BYTES_PER_POINT = 160;
export const PDCT_CLIP_SECONDS_PER_POINT = 4e-07;
export const PDCT_CLIP_BYTES_PER_NUMBER = 64;
export const PDCT_CLIP_SECONDS_PER_FRAME = 0.0006;

// gvcodecs.pdct.delta_coding
export const PDCT_DELTA_CODING_PROBLEMS = ["", "its range-coded data do not decode", "its raw bits end too early"];

// gvcodecs.pdct.header
export const PDCT_HEADER_MAX_CLIPS = 4000;
export const PDCT_HEADER_VERSION = 1;

// gvcodecs.pdct.reader
export const PDCT_READER_BYTES_PER_POINT = 200;
export const PDCT_READER_SECONDS_PER_POINT = 1e-06;

// gvcodecs.pdct.seed_coding
export const PDCT_SEED_CODING_ORDERS = [1, 2];
export const PDCT_SEED_CODING_MAX_COORDINATE = 1073741824;

// gvcodecs.pdct.still_points
export const PDCT_STILL_POINTS_SECTION = "still";
