// A mesh file; the first byte says of which format.
#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

#include "sdk/io/mesh_formats.hpp"
#include "sdk/io/ply_file.hpp"

namespace {

void require(bool is_true) {
    if (!is_true) std::abort();
}

void check(const defrec::cli::MeshFile& mesh) {
    require(mesh.triangles.size() % 3 == 0 && mesh.vertices.size() % 3 == 0);
    for (const std::uint32_t vertex : mesh.triangles) require(vertex < mesh.vertices.size() / 3);
    std::size_t in_parts = 0;
    for (const defrec::cli::MeshPart& part : mesh.parts) {
        require(part.first_triangle == in_parts);
        in_parts += part.triangle_count;
    }
    require(mesh.parts.empty() || in_parts == mesh.triangles.size() / 3);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    using namespace defrec::cli;
    if (size == 0) return 0;
    const std::string_view bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
    try {
        if (data[0] == 'p') {
            const PlyFile ply = read_ply(bytes, "fuzz");
            for (const std::uint32_t vertex : ply.triangles) require(vertex < ply.vertex_count);
            require(ply.names.size() == ply.values.size());
            for (const std::vector<double>& column : ply.values)
                require(column.size() == ply.vertex_count);
            check(read_ply_mesh(bytes, "fuzz"));
        } else if (data[0] == 'o') {
            check(read_obj(bytes, "fuzz"));
        } else if (is_binary_stl(bytes)) {
            check(read_binary_stl(bytes, "fuzz"));
        } else {
            check(read_text_stl(bytes, "fuzz"));
        }
    } catch (const CliError&) {
    }
    return 0;
}
