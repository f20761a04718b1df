#include "mesh/openmesh.h"

/* OpenMesh's assertions would end the program, and take a third of its time. */
#ifndef NDEBUG
#define NDEBUG
#endif
#if defined __GNUC__ && !defined __clang__
/* OpenMesh's vectors leave new elements uninitialised on purpose. */
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#endif

#include <OpenMesh/Core/IO/MeshIO.hh>
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Core/System/omstream.hh>
#include <OpenMesh/Tools/Decimater/DecimaterT.hh>
#include <OpenMesh/Tools/Decimater/ModNormalFlippingT.hh>
#include <OpenMesh/Tools/Decimater/ModQuadricT.hh>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <locale>
#include <mutex>
#include <new>
#include <ostream>
#include <streambuf>
#include <vector>

extern "C" {
#include "base/diagnostic.h"
}

namespace {

using OpenMesh::HalfedgeHandle;
using OpenMesh::VertexHandle;

struct FileTraits : OpenMesh::DefaultTraits {
  VertexAttributes(OpenMesh::Attributes::Normal);
};
using FileMesh = OpenMesh::TriMesh_ArrayKernelT<FileTraits>;

struct WorkTraits : OpenMesh::DefaultTraits {
  using Point = OpenMesh::Vec3d;
  using Normal = OpenMesh::Vec3d;
  VertexAttributes(OpenMesh::Attributes::Status);
  EdgeAttributes(OpenMesh::Attributes::Status);
  HalfedgeAttributes(OpenMesh::Attributes::PrevHalfedge);
  FaceAttributes(OpenMesh::Attributes::Status | OpenMesh::Attributes::Normal);
};
using WorkMesh = OpenMesh::TriMesh_ArrayKernelT<WorkTraits>;

/* Run `work`; whatever it throws becomes an error. */
template <typename Work> bool guarded(zs_diag *diag, Work work)
{
  try {
    return work();
  } catch (const std::bad_alloc &) {
    return zs_fail_memory(diag);
  } catch (const std::exception &problem) {
    return zs_fail(diag, ZS_ERROR_UNABLE, nullptr, "OpenMesh failed: %s", problem.what());
  } catch (...) {
    return zs_fail(diag, ZS_ERROR_UNABLE, nullptr, "OpenMesh failed");
  }
}

/* ---- From arrays to half-edges ---------------------------------------------- */

/* A side of a triangle, by its edge's lower and higher vertex. */
struct Side {
  uint32_t lower, higher, number; /* 3 * triangle + side */
  bool operator<(const Side &other) const
  {
    if (lower != other.lower)
      return lower < other.lower;
    return higher != other.higher ? higher < other.higher : number < other.number;
  }
};

std::vector<Side> sorted_sides(const zs_mesh *mesh)
{
  std::vector<Side> sides;
  sides.reserve(3 * mesh->triangle_count);
  for (size_t t = 0; t < mesh->triangle_count; t++)
    for (uint32_t k = 0; k < 3; k++) {
      uint32_t a = mesh->triangles[3 * t + k], b = mesh->triangles[3 * t + (k + 1) % 3];
      sides.push_back({std::min(a, b), std::max(a, b), uint32_t(3 * t + k)});
    }
  std::sort(sides.begin(), sides.end());
  return sides;
}

/* Make edges, faces and their links directly: several times faster than adding
 * face by face, and independent of the order of the triangles. */
template <typename Mesh> void build(const zs_mesh *source, Mesh &mesh)
{
  const std::vector<Side> sides = sorted_sides(source);
  std::vector<HalfedgeHandle> halfedges(sides.size());
  mesh.resize(0, 0, 0);
  mesh.reserve(source->vertex_count, sides.size() / 2, source->triangle_count);
  for (size_t v = 0; v < source->vertex_count; v++) {
    const float *p = source->positions + 3 * v;
    mesh.add_vertex(typename Mesh::Point(p[0], p[1], p[2]));
  }
  for (size_t i = 0; i < sides.size(); i++) {
    const Side &side = sides[i];
    bool second = i > 0 && sides[i - 1].lower == side.lower && sides[i - 1].higher == side.higher;
    bool upward = source->triangles[side.number] == side.lower;
    if (second) {
      halfedges[side.number] = mesh.opposite_halfedge_handle(halfedges[sides[i - 1].number]);
    } else {
      VertexHandle lower(int(side.lower)), higher(int(side.higher));
      halfedges[side.number] =
        upward ? mesh.new_edge(lower, higher) : mesh.new_edge(higher, lower);
    }
  }
  for (size_t t = 0; t < source->triangle_count; t++) {
    auto face = mesh.new_face();
    mesh.set_halfedge_handle(face, halfedges[3 * t]);
    for (size_t k = 0; k < 3; k++) {
      HalfedgeHandle h = halfedges[3 * t + k];
      mesh.set_face_handle(h, face);
      mesh.set_next_halfedge_handle(h, halfedges[3 * t + (k + 1) % 3]);
      mesh.set_halfedge_handle(VertexHandle(int(source->triangles[3 * t + k])), h);
    }
  }
  /* A vertex on the boundary refers to its outgoing boundary half-edge. */
  for (auto h : mesh.halfedges())
    if (mesh.is_boundary(HalfedgeHandle(h)))
      mesh.set_halfedge_handle(mesh.from_vertex_handle(h), h);
  for (auto h : mesh.halfedges())
    if (mesh.is_boundary(HalfedgeHandle(h)))
      mesh.set_next_halfedge_handle(h, mesh.halfedge_handle(mesh.to_vertex_handle(h)));
}

/* ---- Writing ------------------------------------------------------------------ */

/* A C stream as a C++ one. */
class StreamBuffer : public std::streambuf {
public:
  explicit StreamBuffer(FILE *stream) : stream_(stream) {}

protected:
  int_type overflow(int_type c) override
  {
    if (traits_type::eq_int_type(c, traits_type::eof()))
      return traits_type::not_eof(c);
    return std::fputc(c, stream_) == EOF ? traits_type::eof() : c;
  }
  std::streamsize xsputn(const char *bytes, std::streamsize count) override
  {
    return std::streamsize(std::fwrite(bytes, 1, size_t(count), stream_));
  }

private:
  FILE *stream_;
};

/* OpenMesh's writers print to streams of the whole program, and are shared by
 * all threads: one at a time, in silence. */
class Silence {
public:
  Silence() : lock_(mutex()), errors_(omerr().is_enabled()), log_(omlog().is_enabled())
  {
    omerr().disable();
    omlog().disable();
  }
  ~Silence()
  {
    if (errors_)
      omerr().enable();
    if (log_)
      omlog().enable();
  }
  Silence(const Silence &) = delete;
  Silence &operator=(const Silence &) = delete;

private:
  static std::mutex &mutex()
  {
    static std::mutex one;
    return one;
  }
  std::lock_guard<std::mutex> lock_;
  bool errors_, log_;
};

/* ---- Simplifying ---------------------------------------------------------------- */

/* Refuses collapses that would take a vertex too far from the planes it stands
 * for.  OpenMesh's own bound is on distances weighted by area, which is no
 * length. */
template <typename MeshT> class ModDistanceT : public OpenMesh::Decimater::ModBaseT<MeshT> {
public:
  DECIMATING_MODULE(ModDistanceT, MeshT, Distance)
  using Quadric = OpenMesh::Geometry::QuadricT<double>;

  explicit ModDistanceT(Mesh &mesh) : Base(mesh, true)
  {
    mesh.add_property(quadrics_);
  }
  ~ModDistanceT() override
  {
    Base::mesh().remove_property(quadrics_);
  }
  void set_limit(double error)
  {
    limit_ = error * error;
  }
  void initialize() override
  {
    Mesh &mesh = Base::mesh();
    for (auto v : mesh.vertices())
      mesh.property(quadrics_, v).clear();
    for (auto f : mesh.faces()) {
      auto n = mesh.calc_face_normal(f);
      auto h = mesh.halfedge_handle(f);
      Quadric q(n[0], n[1], n[2], -(n | mesh.point(mesh.to_vertex_handle(h))));
      for (int k = 0; k < 3; k++, h = mesh.next_halfedge_handle(h))
        mesh.property(quadrics_, mesh.to_vertex_handle(h)) += q;
    }
  }
  float collapse_priority(const OpenMesh::Decimater::CollapseInfoT<MeshT> &collapse) override
  {
    Quadric q = Base::mesh().property(quadrics_, collapse.v0);
    q += Base::mesh().property(quadrics_, collapse.v1);
    return float(q(collapse.p1) <= limit_ ? Base::LEGAL_COLLAPSE : Base::ILLEGAL_COLLAPSE);
  }
  void postprocess_collapse(const OpenMesh::Decimater::CollapseInfoT<MeshT> &collapse) override
  {
    Base::mesh().property(quadrics_, collapse.v1) +=
      Base::mesh().property(quadrics_, collapse.v0);
  }

private:
  double limit_ = 0;
  OpenMesh::VPropHandleT<Quadric> quadrics_;
};

/* Passes progress on, and a wish to stop. */
class Watcher : public OpenMesh::Decimater::Observer {
public:
  Watcher(const zs_control *control, size_t vertices)
    : Observer(1000), control_(control), vertices_(double(vertices))
  {
  }
  void notify(size_t step) override
  {
    cancelled_ = cancelled_ ||
                 (control_ && control_->progress &&
                  !control_->progress(control_->context, "simplify", double(step) / vertices_));
  }
  bool abort() const override
  {
    return cancelled_;
  }

private:
  const zs_control *control_;
  double vertices_;
  bool cancelled_ = false;
};

uint32_t *copy(const std::vector<uint32_t> &numbers)
{
  void *memory = std::malloc(std::max<size_t>(numbers.size(), 1) * sizeof(uint32_t));
  if (!memory)
    throw std::bad_alloc();
  if (!numbers.empty())
    std::memcpy(memory, numbers.data(), numbers.size() * sizeof(uint32_t));
  return static_cast<uint32_t *>(memory);
}

} // namespace

extern "C" bool zs_openmesh_write(const zs_mesh *source, FILE *stream, zs_diag *diag)
{
  return guarded(diag, [&] {
    FileMesh mesh;
    build(source, mesh);
    OpenMesh::IO::Options options(OpenMesh::IO::Options::Binary);
    if (source->normals) {
      options += OpenMesh::IO::Options::VertexNormal;
      for (size_t v = 0; v < source->vertex_count; v++) {
        const float *n = source->normals + 3 * v;
        mesh.set_normal(VertexHandle(int(v)), FileMesh::Normal(n[0], n[1], n[2]));
      }
    }
    StreamBuffer buffer(stream);
    std::ostream output(&buffer);
    output.imbue(std::locale::classic());
    Silence silence;
    bool written = OpenMesh::IO::write_mesh(mesh, output, ".om", options);
    return written || std::ferror(stream) ||
           zs_fail(diag, ZS_ERROR_UNABLE, nullptr, "OpenMesh cannot write the mesh");
  });
}

extern "C" bool zs_openmesh_simplify(const zs_mesh *source, double error,
                                     const zs_control *control, uint32_t **kept,
                                     size_t *kept_count, uint32_t **triangles,
                                     size_t *triangle_count, zs_diag *diag)
{
  using namespace OpenMesh::Decimater;
  *kept = *triangles = nullptr;
  bool done = guarded(diag, [&] {
    WorkMesh mesh;
    build(source, mesh);
    mesh.update_face_normals();
    Watcher watcher(control, source->vertex_count);
    DecimaterT<WorkMesh> decimater(mesh);
    ModQuadricT<WorkMesh>::Handle quadric;
    ModDistanceT<WorkMesh>::Handle distance;
    ModNormalFlippingT<WorkMesh>::Handle flipping;
    decimater.add(quadric);
    decimater.add(distance);
    decimater.add(flipping);
    decimater.module(distance).set_limit(error);
    decimater.module(flipping).set_max_normal_deviation(60);
    decimater.set_observer(&watcher);
    if (!decimater.initialize())
      return zs_fail(diag, ZS_ERROR_UNABLE, nullptr, "OpenMesh cannot simplify the mesh");
    decimater.decimate();
    if (watcher.abort())
      return zs_fail(diag, ZS_CANCELLED, nullptr, "cancelled");
    std::vector<uint32_t> left, corners;
    for (size_t v = 0; v < source->vertex_count; v++)
      if (!mesh.status(VertexHandle(int(v))).deleted())
        left.push_back(uint32_t(v));
    for (auto f : mesh.faces()) /* passes over deleted ones */
      for (auto v : mesh.fv_range(f))
        corners.push_back(uint32_t(v.idx()));
    *kept = copy(left);
    *triangles = copy(corners);
    *kept_count = left.size();
    *triangle_count = corners.size() / 3;
    return true;
  });
  if (!done) {
    std::free(*kept);
    std::free(*triangles);
    *kept = *triangles = nullptr;
  }
  return done;
}
