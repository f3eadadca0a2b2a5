// Meshes of other programs: what is read of each format, and what is refused.
#include "sdk/io/mesh_file.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sdk/io/mesh_formats.hpp"
#include "sdk/io/test_folder.hpp"
#include "sdk/io/test_refusal.hpp"

using namespace defrec::cli;

namespace {

// A tetrahedron of 100 mm.
constexpr const char* kObj =
    "# a model\nv 0 0 0\nv 100 0 0\nv 0 100 0\nv 0 0 100\nvn 0 0 1\n"
    "f 1 3 2\nf 1/1 2/1 4/1\nf 1//1 4//1 3//1\nf -3 -2 -1\n";
constexpr const char* kPly =
    "ply\nformat ascii 1.0\ncomment made by hand\nelement vertex 4\nproperty float x\nproperty "
    "float y\nproperty float z\nproperty float quality\nelement face 4\nproperty list uchar int "
    "vertex_indices\nend_header\n0 0 0 1\n100 0 0 1\n0 100 0 1\n0 0 100 1\n3 0 2 1\n3 0 1 3\n3 0 3 "
    "2\n3 1 2 3\n";
constexpr const char* kStl =
    "solid organ\nfacet normal 0 0 -1\nouter loop\nvertex 0 0 0\nvertex 0 100 0\nvertex 100 0 "
    "0\nendloop\nendfacet\nfacet normal 0 -1 0\nouter loop\nvertex 0 0 0\nvertex 100 0 0\nvertex 0 "
    "0 "
    "1e2\nendloop\nendfacet\nendsolid organ\n";

template <class Number>
void append(std::string& bytes, Number number, bool is_big = false) {
    char raw[sizeof number];
    std::memcpy(raw, &number, sizeof number);
    if (is_big) std::reverse(raw, raw + sizeof number);
    bytes.append(raw, sizeof number);
}

std::string binary_ply(bool is_big) {
    std::string bytes =
        std::string("ply\nformat binary_") + (is_big ? "big" : "little") +
        "_endian 1.0\nelement vertex 4\nproperty double x\nproperty float "
        "y\nproperty short z\nelement edge 1\nproperty int a\nelement face "
        "2\nproperty uchar flag\nproperty list uchar uint vertex_index\nend_header\n";
    for (int i = 0; i < 4; ++i) {
        append(bytes, 10.0 * i, is_big);
        append(bytes, 20.0f * static_cast<float>(i % 2), is_big);
        append(bytes, static_cast<std::int16_t>(i == 3 ? -30 : 0), is_big);
    }
    append(bytes, std::int32_t{7}, is_big);
    for (const std::vector<std::uint32_t>& face :
         {std::vector<std::uint32_t>{0, 1, 2, 3}, std::vector<std::uint32_t>{0, 2, 1}}) {
        append(bytes, std::uint8_t{9}, is_big);
        append(bytes, static_cast<std::uint8_t>(face.size()), is_big);
        for (const std::uint32_t vertex : face) append(bytes, vertex, is_big);
    }
    return bytes;
}

std::string binary_stl(std::uint32_t count, const char* begin = "exported") {
    std::string bytes = begin;
    bytes.resize(80, ' ');
    append(bytes, count);
    for (std::uint32_t i = 0; i < count; ++i) {
        for (int k = 0; k < 3; ++k) append(bytes, 0.0f);
        for (const float value :
             {0.0f, 0.0f, 0.0f, 100.0f, 0.0f, 0.0f, 0.0f, 100.0f, static_cast<float>(i)})
            append(bytes, value);
        append(bytes, std::uint16_t{0});
    }
    return bytes;
}

std::string refusal(const std::string& name, const std::string& bytes) {
    const TestFolder folder;
    const std::string path = folder.write(name, bytes);
    return refusal_of([&] { read_mesh_file(path); });
}

MeshFile read(const std::string& name, const std::string& bytes) {
    const TestFolder folder;
    return read_mesh_file(folder.write(name, bytes));
}

}  // namespace

TEST_CASE("OBJ: faces of every form, and groups, which may go on later") {
    const MeshFile mesh = read("model.obj", kObj);
    CHECK(mesh.vertices.size() == 12);
    CHECK(mesh.triangles == std::vector<std::uint32_t>{0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3});
    CHECK(mesh.parts.empty());
    const MeshFile one = read("model.obj", "v 0 0 0\nv 9 0 0\nv 0 9 0\ng organ\nf 1 2 3\n");
    REQUIRE(one.parts.size() == 1);
    CHECK(one.part("organ").triangles == std::vector<std::uint32_t>{0, 1, 2});
    const MeshFile parts = read("model.OBJ",
                                "v 0 0 0\nv 9 0 0\nv 0 9 0\nv 0 0 9\ng organ right\nf 1 2 3\no "
                                "tumour\nf 1 2 4\ng organ right\nf 2 3 4 1\n");
    REQUIRE(parts.parts.size() == 2);
    CHECK(parts.parts[0].name == "organ right");
    CHECK(parts.parts[0].triangle_count == 3);
    CHECK(parts.parts[1].name == "tumour");
    CHECK(parts.part("tumour").triangles == std::vector<std::uint32_t>{0, 1, 3});
    CHECK(parts.part("organ right").triangles ==
          std::vector<std::uint32_t>{0, 1, 2, 1, 2, 3, 1, 3, 0});
    try {
        parts.part("liver");
        FAIL("accepted");
    } catch (const CliError& error) {
        CHECK(error.code() == ExitCode::kUsage);
        CHECK_SAYS(std::string(error.what()), "organ right, tumour");
    }
}

TEST_CASE("PLY: text, binary of both byte orders, further elements, polygons") {
    const MeshFile text = read("model.ply", kPly);
    CHECK(text.vertices.size() == 12);
    CHECK(text.triangles == std::vector<std::uint32_t>{0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3});
    // Lists of the vertices, which may be empty, are left out.
    const MeshFile lists = read("model.ply",
                                "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty "
                                "list uchar double a\nproperty char x\nproperty char y\nproperty "
                                "char z\nelement face 1\nproperty list uchar char "
                                "vertex_indices\nend_header\n" +
                                    std::string("\0\1\2\3\0\4\5\6\0\7\10\11\3\0\1\2", 16));
    CHECK(lists.vertices == std::vector<float>{1, 2, 3, 4, 5, 6, 7, 8, 9});
    for (const bool is_big : {false, true}) {
        CAPTURE(is_big);
        const MeshFile binary = read("model.ply", binary_ply(is_big));
        CHECK(binary.vertices == std::vector<float>{0, 0, 0, 10, 20, 0, 20, 0, 0, 30, 20, -30});
        CHECK(binary.triangles == std::vector<std::uint32_t>{0, 1, 2, 0, 2, 3, 0, 2, 1});
    }
}

TEST_CASE("STL: text and binary, vertices at one place are one, solids are parts") {
    const MeshFile text = read("model.stl", kStl);
    CHECK(text.vertices.size() == 12);
    CHECK(text.triangles == std::vector<std::uint32_t>{0, 1, 2, 0, 2, 3});
    CHECK(text.parts.empty());
    const MeshFile two = read("model.stl", std::string(kStl) + kStl);
    CHECK(two.parts.size() == 2);
    // Some programs begin binary files with solid.
    for (const char* begin : {"exported", "solid"}) {
        const MeshFile binary = read("model.stl", binary_stl(2, begin));
        CHECK(binary.triangles == std::vector<std::uint32_t>{0, 1, 2, 0, 1, 3});
        CHECK(binary.vertices.size() == 12);
    }
}

TEST_CASE("row 171: mesh files that are cut short, at every byte") {
    const std::string ply = binary_ply(false), stl = binary_stl(2);
    for (std::size_t size = 0; size < ply.size(); ++size)
        CHECK(refusal("model.ply", ply.substr(0, size)) != "accepted");
    for (std::size_t size = 0; size < stl.size(); ++size)
        CHECK(refusal("model.stl", stl.substr(0, size)) != "accepted");
    const std::string text = kStl;
    for (std::size_t size = 0; size + 12 < text.size(); ++size)
        CHECK(refusal("model.stl", text.substr(0, size)) != "accepted");
    CHECK_SAYS(refusal("model.ply", ply.substr(0, ply.size() - 1)), "cut short");
    CHECK_SAYS(refusal("model.stl", stl.substr(0, stl.size() - 1)), "has 183: it is cut short");
    CHECK_SAYS(refusal("model.stl", text.substr(0, text.size() - 16)), "endsolid was expected");
    CHECK_SAYS(refusal("model.ply", ply + "x"), "1 bytes follow the last element");
    // A text file may lack the last vertices that its faces have.
    CHECK_SAYS(refusal("model.obj", "v 0 0 0\nv 1 0 0\nf 1 2 3\n"), "a face has vertex 3");
}

TEST_CASE("row 171: mesh files that are refused, each with the place and what was expected") {
    CHECK_SAYS(refusal("model.obj", ""), "the file is empty");
    CHECK_SAYS(refusal("model.vtk", "# vtk"), "the name ends with '.vtk'; .stl, .obj or .ply");
    CHECK_SAYS(refusal("model.obj", "v 0 nan 0\nf 1 1 1\n"), "model.obj:1: v: 'nan'");
    CHECK_SAYS(refusal("model.obj", "v 0 1e39 0\n"), "'1e39' is not a finite number");
    CHECK_SAYS(refusal("model.obj", "v 0 0\n"), "model.obj:1: v: ''");
    CHECK_SAYS(refusal("model.obj", "v 0 0 0\nf 1 2\n"), "model.obj:2: a face of at least 3");
    CHECK_SAYS(refusal("model.obj", "v 0 0 0\nf 1 0 1\n"), "'0' is no vertex");
    CHECK_SAYS(refusal("model.obj", "v 0 0 0\n"), "the file has no triangles");
    CHECK_SAYS(refusal("model.obj", std::string("v 0 0 0\n\0", 9)), "the file is binary");
    CHECK_SAYS(refusal("model.ply", "PLY\n"), "which begins with ply");
    CHECK_SAYS(refusal("model.ply", with(kPly, "ascii 1.0", "text 1.0")), "format 'text'");
    CHECK_SAYS(refusal("model.ply", with(kPly, "float quality", "half quality")),
               "'half' is no type");
    CHECK_SAYS(refusal("model.ply", with(kPly, "3 1 2 3", "3 1 2 4")), "a face has vertex 4");
    CHECK_SAYS(refusal("model.ply", with(kPly, "3 1 2 3", "3 1 2 -3")),
               "a vertex that there is not");
    CHECK_SAYS(refusal("model.ply", with(kPly, "0 0 100 1", "0 nan 100 1")),
               "vertex 3 has a coordinate");
    CHECK_SAYS(refusal("model.ply", with(kPly, "0 0 100 1", "0 x 100 1")), "'x' is not a number");
    CHECK_SAYS(refusal("model.ply", with(kPly, "face 4", "face 3000000")), "2000000 at most");
    CHECK_SAYS(refusal("model.ply", with(kPly, "vertex 4", "vertex 5000000")), "cut short");
    CHECK_SAYS(refusal("model.ply", with(kPly, "vertex 4", "vertex 99999999999")),
               "at most 6000000");
    CHECK_SAYS(refusal("model.ply", with(kPly, "property float x", "property float a")),
               "no x, y and z");
    CHECK_SAYS(refusal("model.ply", with(kPly, "element face 4",
                                         "element vertex 9\nproperty float x\nelement face 4")),
               "model.ply:9: element vertex stands here again; one was expected");
    // A list is no coordinate, whatever its name.
    CHECK_SAYS(refusal("model.ply",
                       "ply\nformat ascii 1.0\nelement vertex 1\nproperty list uchar float "
                       "x\nproperty float y\nproperty float z\nelement face 1\nproperty list uchar "
                       "int vertex_indices\nend_header\n1 0 0 0\n3 0 0 0\n"),
               "no x, y and z");
    CHECK_SAYS(refusal("model.stl", with(kStl, "endfacet\nfacet normal 0 -1", "facet normal 0 -1")),
               "model.stl:8: a facet begins before endfacet");
    CHECK_SAYS(refusal("model.stl", with(kStl, "endfacet\nendsolid", "endsolid")),
               "model.stl:15: the solid ends before endfacet");
    CHECK_SAYS(
        refusal("model.stl", with(kStl, "endfacet\nendsolid", "endfacet\nendfacet\nendsolid")),
        "model.stl:16: 'endfacet' stands outside of a facet");
    CHECK_SAYS(refusal("model.stl", with(kStl, "facet normal 0 0 -1\n", "")),
               "model.stl:3: 'vertex' stands outside of a facet");
    CHECK_SAYS(refusal("model.stl", with(kStl, "vertex 0 0 1e2", "vertex 0 0 inf")),
               "model.stl:13: vertex: 'inf'");
    CHECK_SAYS(refusal("model.stl", "hello"), "it is no STL file");
    std::string stl = binary_stl(1);
    stl[80] = '\xff';
    stl[82] = '\xff';
    CHECK_SAYS(refusal("model.stl", stl), "2000000 at most");
    stl = binary_stl(1);
    stl[84 + 12 + 3] = '\x7f';
    stl[84 + 12 + 2] = '\xff';
    CHECK_SAYS(refusal("model.stl", stl), "triangle 0 has a coordinate that is not finite");
    CHECK_SAYS(refusal_of([] { read_mesh_file("/nowhere/model.stl"); }), "there is no such file");
}

TEST_CASE("row 177: the unit of a model is given, or told by its size, or asked for") {
    const auto convert = [](float size, std::optional<MeshUnit> unit) {
        MeshFile mesh;
        mesh.vertices = {0, 0, 0, size, 0, 0, 0, size / 2, 0};
        mesh.triangles = {0, 1, 2};
        to_millimetres(mesh, unit, "liver.stl");
        return mesh;
    };
    CHECK(convert(210, {}).vertices[3] == doctest::Approx(210));
    CHECK(convert(210, {}).notes.empty());
    CHECK(convert(0.21f, {}).vertices[3] == doctest::Approx(210));
    REQUIRE(convert(0.21f, {}).notes.size() == 1);
    CHECK_SAYS(convert(0.21f, {}).notes[0], "taken to be in metres: its longest side is 0.2100");
    CHECK(convert(0.21f, MeshUnit::kMetre).notes.empty());
    CHECK(convert(21, MeshUnit::kCentimetre).vertices[3] == doctest::Approx(210));
    CHECK_SAYS(refusal_of([&] { convert(0.21f, MeshUnit::kMillimetre); }), "--unit mm, cm or m");
    CHECK_SAYS(refusal_of([&] { convert(210, MeshUnit::kMetre); }), "which is 210000.0 mm");
    CHECK_SAYS(refusal_of([&] { convert(4, {}); }), "the longest side of the model is 4.0");
    CHECK_SAYS(refusal_of([&] { convert(210000, {}); }), "10.0 to 2000.0 mm were expected");
    // A tumour alone is small: its unit is given, since its size does not tell it.
    CHECK_SAYS(refusal_of([&] { convert(8, {}); }), "Give its unit as --unit mm, cm or m");
    CHECK(convert(8, MeshUnit::kMillimetre).vertices[3] == doctest::Approx(8));
    CHECK_SAYS(refusal_of([&] { convert(2, MeshUnit::kMillimetre); }),
               "3.0 to 2000.0 mm were expected. If another unit is meant");
}
