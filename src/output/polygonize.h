/* Inside the polygonizer: shared by its files only.
 *
 * Samples sit at the corners of a lattice: the corners of the grid's cells,
 * and one more plane of corners on every side.  Those outermost corners ("pads")
 * lie at the same place as their neighbours on the grid's faces and count as
 * outside, so that the cells between them close the surface with flat caps.
 *
 * The lattice is cut into bricks of 16 x 16 x 16 corners.  A brick owns its
 * corners, the edges that start at them and the cells that start at them.  Every
 * lattice edge whose ends have different signs carries one vertex, numbered by
 * brick, row and axis; no stage needs a lock. */
#ifndef ZS_POLYGONIZE_H
#define ZS_POLYGONIZE_H

#include "field/program.h"
#include "mesh/mesh.h"
#include "output/contour_table.h"

enum {
  ZS_BRICK = 16,                          /* corners of a brick per axis */
  ZS_BRICK_ROWS = ZS_BRICK * ZS_BRICK,    /* rows along x: 16 z + y */
  ZS_BRICK_CORNERS = ZS_BRICK_ROWS * ZS_BRICK,
  ZS_REACH = ZS_BRICK + 1                 /* corners of its cells */
};

typedef uint16_t zs_row_bits[ZS_BRICK_ROWS]; /* bit x of a row: a corner, edge or cell */

/* Whether a row has edges along any axis: most have none. */
static inline bool zs_row_has(const zs_row_bits crossing[3], unsigned row)
{
  return (crossing[0][row] | crossing[1][row] | crossing[2][row]) != 0;
}

/* Corners closer to the surface than this part of a cell are moved away along
 * the gradient, to this distance: no triangle gets very small, and the cells
 * stay convex enough never to overlap. */
static const float ZS_REPULSION = 0.1f;

/* A corner that was moved away from the surface (see polygonize_sample.c). */
typedef struct zs_moved {
  uint16_t corner; /* 256 z + 16 y + x in its brick */
  float offset[3]; /* from the lattice */
} zs_moved;

/* A vertex inside a cell, on a sharp edge or corner of the surface (see
 * polygonize_creases.c). */
typedef struct zs_crease {
  uint16_t cell;   /* 256 z + 16 y + x in its brick */
  uint16_t edges;  /* of the loop that it belongs to, one bit each; 0: given up */
  float place[3];  /* in the brick's frame */
  float normal[3]; /* out of the solid */
  bool alone;      /* no other vertex can be where it is */
} zs_crease;

/* For every eight bits, which of them are set, in ascending order, how many, and how many
 * below each. */
typedef struct zs_bit_table {
  uint8_t places[256][8], counts[256], below[256][8];
} zs_bit_table;

void zs_bit_table_make(zs_bit_table *table);

typedef struct zs_normal_box {
  float lo[3], hi[3]; /* lo > hi: empty */
} zs_normal_box;

/* The surface in a cell, of which the features method makes one vertex: a loop of
 * crossing edges (see polygonize_features.c). */
typedef struct zs_patch {
  uint16_t cell;  /* 256 z + 16 y + x in its brick */
  uint16_t edges; /* of the loop, one bit each */
  bool sharp;     /* its vertex lies on a sharp edge or corner */
  bool corner;    /* in a corner */
  bool aside;     /* beside a sharp edge that passes by its cell */
  bool suspect;   /* of a quad that is folded however it is cut */
  bool turned;    /* a mesh edge around it was turned */
  bool folded;    /* of a triangle that is still folded when edges have been turned */
} zs_patch;

/* A patch whose planes meet in another cell (see polygonize_features_claims.c). */
typedef struct zs_claim {
  zs_patch *patch;
  uint32_t vertex;  /* of the patch */
  uint32_t cell[3]; /* where they meet: its place in the lattice */
  unsigned rank;    /* 2 on a sharp edge, 3 in a corner */
  double place[3];
  float normal[3]; /* away from all of them */
} zs_claim;

typedef struct zs_claims {
  zs_claim *items;
  size_t count, room;
} zs_claims;

typedef struct zs_brick zs_brick;
struct zs_brick {
  uint32_t index[3];
  const zs_program *program;           /* serves the closed brick; of sampled ones */
  zs_row_bits signs;                   /* corners that are inside */
  zs_row_bits crossing[3];             /* by axis: edges with a vertex of their own */
  uint16_t first[ZS_BRICK_ROWS];       /* vertices of the rows before */
  uint32_t vertex_count, triangle_count;
  uint32_t loop_count; /* of its cells: so many creases at most */
  size_t first_vertex, first_triangle;
  const zs_moved *moved;
  uint32_t moved_count;
  /* f at the ends of the crossing edges that lie in the brick, in the order of
   * zs_edge_list: at all inner ends, then at all outer ones; NULL when not known, and
   * after vertices are found. */
  const float *ends;
  uint32_t end_count; /* of those edges */
  zs_crease *creases; /* in ascending order of cells */
  uint32_t crease_count, crowded_count; /* of them, those that are not alone */
  size_t first_crease; /* the vertex of the first one */
  /* Boxes that hold the normals of its vertices: of all, and by axis of those in
   * its lower side across the axis. */
  zs_normal_box all_normals, side_normals[3];
  zs_patch *patches; /* in ascending order of cells */
  const uint16_t *patch_rows; /* patches of the rows of cells before; one more */
  uint32_t patch_count;
  size_t first_patch; /* the vertex of the first one */
  bool sampled; /* false: bounds know that all of it is inside */
  bool at_face; /* some of its edges or cells may lead to pads */
};

/* One thread's working data. */
typedef struct zs_polygonize_worker {
  zs_arena arena; /* holds bricks and what they point to */
  zs_arena ends;  /* but for the ends of edges: until there are vertices */
  zs_eval *eval;
  uint64_t evaluations;
  zs_claims claims;
  bool out_of_memory;
  void *scratch; /* of the stage at work */
} zs_polygonize_worker;

typedef struct zs_polygonize_job {
  zs_field *field;
  const zs_control *control;
  zs_diag *diag;
  bool cap, normals, creases;
  bool features; /* a vertex for every loop of a cell, not for every crossing edge */
  unsigned threads;
  double tolerance;  /* of vertices, in scene units */
  double apart;      /* least distance of a vertex from the ends of its edge */
  double collapse;   /* how far planes may be from a vertex that stands for several */
  zs_contour_table cases;
  zs_bit_table bit_table;
  double lo[3], cell[3];
  uint32_t corners[3]; /* of the lattice, pads included */
  uint32_t bricks[3];
  /* By brick, x fastest.  `outside` and `inside` stand for all bricks that
   * bounds decided. */
  const zs_brick **table;
  zs_brick outside, inside;
  zs_brick **active; /* bricks that hold data of their own, in order of the table */
  size_t active_count, vertex_count, triangle_count; /* creases included once known */
  size_t loop_count;
  size_t patch_count;
  zs_polygonize_worker *workers;
  zs_arena *programs; /* one per thread: the bricks' programs */
  zs_mesh *mesh; /* its vertices lie on the crossing edges */
  zs_mesh *dual; /* of the features method, with those of the patches */
  uint64_t used_bytes; /* working memory besides the arenas */
} zs_polygonize_job;

/* ---- The lattice ------------------------------------------------------------ */

/* Lattice coordinate of a brick's corner. */
static inline uint32_t zs_lattice_index(const zs_brick *brick, int axis, unsigned local)
{
  return brick->index[axis] * ZS_BRICK + local;
}

/* Scene coordinate of lattice plane i: pads coincide with the grid's faces. */
static inline double zs_lattice_place(const zs_polygonize_job *job, int axis, uint32_t i)
{
  uint32_t last = job->corners[axis] - 2;
  uint32_t at = i < 1 ? 1 : i > last ? last : i;
  return job->lo[axis] + job->cell[axis] * (at - 1);
}

/* Whether plane i lies on a face of the grid. */
static inline bool zs_lattice_on_face(const zs_polygonize_job *job, int axis, uint32_t i)
{
  return i == 1 || i == job->corners[axis] - 2;
}

/* Whether the edge that starts at plane i leads to or from a pad. */
static inline bool zs_lattice_pad_edge(const zs_polygonize_job *job, int axis, uint32_t i)
{
  return i == 0 || i == job->corners[axis] - 2;
}

/* Coordinate of a local plane in the brick's frame, where it would be without pads. */
static inline float zs_brick_place(const zs_polygonize_job *job, int axis, unsigned local)
{
  return (float)(job->cell[axis] * ((double)local - ZS_BRICK / 2));
}

/* The brick at an index; beyond the lattice everything is outside. */
const zs_brick *zs_lattice_brick(const zs_polygonize_job *job, const uint32_t index[3]);

/* The brick or one of its upper neighbours: `d` has a bit for every axis along
 * which it is the next one. */
const zs_brick *zs_brick_upper(const zs_polygonize_job *job, const zs_brick *brick, unsigned d);

/* Corners lo <= i < hi of a brick. */
typedef struct zs_corner_box {
  unsigned lo[3], hi[3];
} zs_corner_box;

/* The bits of a row of corners. */
unsigned zs_corner_box_row(const zs_corner_box *box, unsigned row);

/* The corners of a brick that are not pads; false when there are none. */
bool zs_brick_real_corners(const zs_polygonize_job *job, const uint32_t index[3],
                           zs_corner_box *real);

/* The frame that all of a brick's evaluations use: its origin is the lattice
 * place of corner 8, where it would be without pads. */
zs_frame zs_brick_frame(const zs_polygonize_job *job, const zs_brick *brick);

/* ---- Parts ---------------------------------------------------------------------
 *
 * A brick's edges are solved part by part, as smaller boxes need shorter programs. */

enum { ZS_PARTS = ZS_LANES, ZS_PART_WIDTH = ZS_BRICK / 2, ZS_PART_HEIGHT = ZS_BRICK / 4 };

/* Corners of a part: ZS_PART_WIDTH along x and y, ZS_PART_HEIGHT along z. */
typedef struct zs_part {
  unsigned first[3];
  uint16_t columns; /* bits x of its rows */
} zs_part;

static inline zs_part zs_part_at(unsigned l)
{
  return (zs_part){
    {l % 2 * ZS_PART_WIDTH, l / 2 % 2 * ZS_PART_WIDTH, l / 4 * ZS_PART_HEIGHT},
    (uint16_t)(((1u << ZS_PART_WIDTH) - 1) << l % 2 * ZS_PART_WIDTH)};
}

/* Row i of the part, in its brick. */
static inline unsigned zs_part_row(const zs_part *part, unsigned i)
{
  return (part->first[2] + i / ZS_PART_WIDTH) * ZS_BRICK + part->first[1] + i % ZS_PART_WIDTH;
}

enum { ZS_PART_ROWS = ZS_PART_WIDTH * ZS_PART_HEIGHT };

enum {
  ZS_BRICK_EDGES = 3 * ZS_BRICK_CORNERS,
  ZS_EDGE_RUN = ZS_PART_WIDTH /* edges are listed so many at a time: lists have room for more */
};

/* ---- Cells -------------------------------------------------------------------- */

enum {
  ZS_REACH_PLANE = ZS_REACH * ZS_REACH,
  ZS_REACH_CORNERS = ZS_REACH_PLANE * ZS_REACH
};

/* Place of a local corner in arrays of ZS_REACH_CORNERS. */
static inline size_t zs_reach_offset(unsigned x, unsigned y, unsigned z)
{
  return (size_t)z * ZS_REACH_PLANE + (size_t)y * ZS_REACH + x;
}

/* Ones of sixteen bits, where the processor cannot be relied on to count them. */
static inline unsigned zs_ones(unsigned bits)
{
  bits -= bits >> 1 & 0x5555;
  bits = (bits & 0x3333) + (bits >> 2 & 0x3333);
  bits = (bits + (bits >> 4)) & 0x0f0f;
  return (bits + (bits >> 8)) & 0x1f;
}

/* Signs of a brick's corners and those of its upper neighbours: bit x of
 * rows[z][y]. */
typedef uint32_t zs_brick_rows[ZS_REACH][ZS_REACH];
void zs_brick_gather_signs(const zs_polygonize_job *job, const zs_brick *brick,
                           zs_brick_rows rows);

/* Whether a brick's edges or cells may lead to pads. */
bool zs_brick_at_face(const zs_polygonize_job *job, const uint32_t index[3]);

/* Vertex numbers by axis, then start of their edge; only those of crossing edges
 * mean anything. */
typedef uint32_t zs_edge_numbers[3 * ZS_REACH_CORNERS];
void zs_brick_number_edges(const zs_polygonize_job *job, const zs_brick *brick,
                           zs_edge_numbers numbers);

/* Places of a cell's edges in zs_edge_numbers, less zs_reach_offset of the
 * cell's first corner. */
void zs_cell_edge_offsets(size_t offsets[ZS_CELL_EDGES]);

/* Bits x of the cells of a row that have triangles. */
uint32_t zs_brick_active_cells(const zs_polygonize_job *job, const zs_brick *brick,
                               const zs_brick_rows rows, unsigned y, unsigned z);
/* Whether a cell lies between the grid's face and its pads. */
bool zs_brick_is_pad_cell(const zs_polygonize_job *job, const zs_brick *brick, unsigned x,
                          unsigned y, unsigned z);
/* The active cells of all rows. */
void zs_brick_find_cells(const zs_polygonize_job *job, const zs_brick *brick,
                         const zs_brick_rows rows, zs_row_bits cells);
/* The edges of a cell that lead to pads, one bit each. */
unsigned zs_brick_pad_edges(const zs_polygonize_job *job, const zs_brick *brick,
                            const unsigned cell[3]);
static inline unsigned zs_brick_cell_case(const zs_brick_rows rows, unsigned x, unsigned y,
                                          unsigned z)
{
  return (rows[z][y] >> x & 3) | (rows[z][y + 1] >> x & 3) << 2 | (rows[z + 1][y] >> x & 3) << 4 |
         (rows[z + 1][y + 1] >> x & 3) << 6;
}

/* The case of a cell anywhere, by its lattice index. */
unsigned zs_lattice_cell_case(const zs_polygonize_job *job, const uint32_t cell[3]);

/* ---- Stages ------------------------------------------------------------------- */

/* Visit the active bricks on all threads, each with its worker; the stage takes
 * its part `from` .. `to` of the progress.  False after reporting. */
typedef void zs_polygonize_visit(zs_polygonize_job *job, zs_polygonize_worker *worker,
                                 zs_brick *brick);
bool zs_polygonize_each(zs_polygonize_job *job, const char *stage, double from, double to,
                        zs_polygonize_visit *visit);

/* Find the bricks that hold surface and sample them.  False after reporting. */
bool zs_polygonize_sample(zs_polygonize_job *job);

/* Find the edges with vertices and count the triangles. */
void zs_polygonize_count(const zs_polygonize_job *job, zs_brick *brick);

/* Find vertices and normals.  False after reporting. */
bool zs_polygonize_vertices(zs_polygonize_job *job);

/* Find vertices on sharp edges and corners.  False after reporting. */
bool zs_polygonize_creases(zs_polygonize_job *job);

/* Give up creases at the place of another vertex.  False after reporting. */
bool zs_polygonize_distinct(zs_polygonize_job *job);
/* Find out which creases of a brick are alone. */
void zs_creases_compare(const zs_polygonize_job *job, zs_brick *brick);

/* The vertex of a crease whose loop joins the two given edges of a cell, or
 * false when there is none.  The cell may lie in a neighbour of the brick: its
 * coordinates are -1 .. 16. */
bool zs_crease_find(const zs_polygonize_job *job, const zs_brick *brick, const int cell[3],
                    unsigned edges, uint32_t *vertex);

/* Normals that differ by more, about 32 degrees, are those of a sharp edge. */
static const float ZS_SHARP = 0.85f;

/* Whether two unit normals are those of different sides of a sharp edge. */
static inline bool zs_crease_between(const float a[3], const float b[3])
{
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] < ZS_SHARP;
}

/* Write the triangles.  False after reporting. */
bool zs_polygonize_triangles(zs_polygonize_job *job);

/* ---- Stages of the features method -------------------------------------------- */

/* From vertices on crossing edges to the dual mesh: find the loops of all cells, a
 * vertex for each, let those that belong elsewhere go there, and make two triangles
 * for every crossing edge.  False after reporting. */
bool zs_polygonize_patches(zs_polygonize_job *job);
bool zs_polygonize_patch_vertices(zs_polygonize_job *job);
bool zs_polygonize_claims(zs_polygonize_job *job);
bool zs_polygonize_quads(zs_polygonize_job *job);

/* Turn mesh edges that cut sharp edges off, and those of folded triangles; mark the
 * patches of triangles that stay folded.  False after reporting. */
bool zs_polygonize_turn(zs_polygonize_job *job);

/* Move the vertices of folded patches back into their cells, or the last time forget
 * their normals; says whether there were any.  False after reporting. */
bool zs_polygonize_unfold(zs_polygonize_job *job, bool last, bool *any);

/* Make the vertices fewer where planes agree.  False after reporting. */
bool zs_polygonize_collapse(zs_polygonize_job *job);

#endif
