// Triangle meshes of other programs: STL, OBJ and PLY, as text and binary.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace defrec::cli {

// A named group of triangles, one after the other.
struct MeshPart {
    std::string name;
    std::size_t first_triangle = 0, triangle_count = 0;
};

struct MeshFile {
    std::vector<float> vertices;           // xyz each
    std::vector<std::uint32_t> triangles;  // three vertices each; polygons are divided
    std::vector<MeshPart> parts;           // groups of OBJ, solids of STL; empty: no names
    std::vector<std::string> notes;        // what the user should know, one sentence each

    // The part alone, with all vertices. Throws CliError(kUsage) with the names that there are.
    MeshFile part(const std::string& name) const;
};

// Lengths as the file means them. Throws CliError(kInput) with file, line or byte, what is wrong
// and what was expected: for numbers that are not finite, a vertex that there is not, a file that
// is cut short or of another format, and more triangles than are taken. It is told by its content,
// OBJ by its name.
MeshFile read_mesh_file(const std::filesystem::path& path);

enum class MeshUnit { kMillimetre, kCentimetre, kMetre };
// Turns its lengths into mm. Without a unit the size says whether they are mm or m, and notes tell
// of metres. Throws CliError(kInput) where the size fits neither, or not the unit that is given.
void to_millimetres(MeshFile& mesh, std::optional<MeshUnit> unit, const std::string& path);

}  // namespace defrec::cli
