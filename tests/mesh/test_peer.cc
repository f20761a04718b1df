// OpenMesh's own readers find in our files what we wrote.
#if defined __GNUC__ && !defined __clang__
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized" // in OpenMesh's vectors
#endif

#include <OpenMesh/Core/IO/MeshIO.hh>
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>

#include <csetjmp>
#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <string>

#include <unistd.h>

extern "C" {
#include "solids.h"

#include <cmocka.h>
}

using Mesh = OpenMesh::TriMesh_ArrayKernelT<>;

static void check_format(const char *ending, bool has_normals)
{
  const std::string name = "test-mesh-peer-" + std::to_string(long(getpid())) + "." + ending;
  zs_mesh *mesh = make_torus(17, 13, 1.5, 1.0 / 3, true);
  assert_non_null(mesh);
  assert_true(zs_mesh_write(mesh, name.c_str(), nullptr));
  Mesh peer;
  peer.request_vertex_normals();
  OpenMesh::IO::Options options(OpenMesh::IO::Options::VertexNormal);
  bool read = OpenMesh::IO::read_mesh(peer, name, options);
  std::remove(name.c_str());
  assert_true(read);
  assert_int_equal(peer.n_vertices(), mesh->vertex_count);
  assert_int_equal(peer.n_faces(), mesh->triangle_count);
  assert_int_equal(peer.n_edges(), mesh->triangle_count * 3 / 2);
  if (has_normals)
    assert_true(options.check(OpenMesh::IO::Options::VertexNormal));
  for (auto f : peer.faces()) {
    const uint32_t *corners = mesh->triangles + 3 * f.idx();
    float expected[3] = {0, 0, 0}, found[3] = {0, 0, 0};
    for (auto v : peer.fv_range(f))
      for (int k = 0; k < 3; k++)
        found[k] += peer.point(v)[k];
    for (int c = 0; c < 3; c++)
      for (int k = 0; k < 3; k++)
        expected[k] += mesh->positions[3 * corners[c] + k];
    for (int k = 0; k < 3; k++)
      assert_true(std::abs(expected[k] - found[k]) < 1e-5f);
  }
  for (auto v : peer.vertices())
    if (has_normals)
      for (int k = 0; k < 3; k++)
        assert_true(std::abs(peer.normal(v)[k] - mesh->normals[3 * v.idx() + k]) < 1e-5f);
  zs_mesh_free(mesh);
}

static void stl(void **)
{
  check_format("stl", false);
}

static void ply(void **)
{
  check_format("ply", true);
}

static void obj(void **)
{
  check_format("obj", true);
}

static void off(void **)
{
  check_format("off", false);
}

static void om(void **)
{
  check_format("om", true);
}

int main()
{
  const CMUnitTest tests[] = {
    cmocka_unit_test(stl), cmocka_unit_test(ply), cmocka_unit_test(obj),
    cmocka_unit_test(off), cmocka_unit_test(om),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
