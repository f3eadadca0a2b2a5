// PLY, text and binary: the numbers of its vertices by name, and its faces.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace defrec::cli {

struct PlyFile {
    // The vertices' numbers, such as x, nx, xx; their lists are left out.
    std::vector<std::string> names;
    std::vector<std::vector<double>> values;  // of each name, one for each vertex
    std::vector<std::uint32_t> triangles;     // three vertices each; polygons are divided
    std::size_t vertex_count = 0;

    // Null where there is no such name.
    const std::vector<double>* find(std::string_view column) const;
};

// name: the file's, for messages. Throws CliError(kInput) for what is no PLY, is cut short, goes on
// after its end, has a vertex that there is not, names its vertices twice, or is too large. Numbers
// need not be finite.
PlyFile read_ply(std::string_view bytes, const std::string& name);

}  // namespace defrec::cli
