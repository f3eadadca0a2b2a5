// See mesh_file.hpp.
#include "sdk/io/mesh_file.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <limits>

#include "sdk/io/decisions.hpp"
#include "sdk/io/mesh_formats.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

using decisions::MeshFiles;

MeshFile from_bytes(std::string_view bytes, const std::filesystem::path& path) {
    const std::string name = path.string();
    std::string extension = path.extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    if (bytes.empty()) fail_mesh(name, "the file is empty; an STL, OBJ or PLY file was expected.");
    if (bytes.starts_with("ply\n") || bytes.starts_with("ply\r")) return read_ply_mesh(bytes, name);
    if (extension == ".obj" || extension == ".ply") {
        if (extension == ".ply")
            fail_mesh(name, 1, "a PLY file was expected, which begins with ply.");
        require_text(bytes, name, ExitCode::kInput);
        return read_obj(bytes, name);
    }
    if (extension == ".stl" && is_binary_stl(bytes)) return read_binary_stl(bytes, name);
    if (extension == ".stl" && bytes.starts_with("solid")) {
        require_text(bytes, name, ExitCode::kInput);
        return read_text_stl(bytes, name);
    }
    if (extension == ".stl")
        fail_mesh(name, "the file has " + std::to_string(bytes.size()) +
                            " bytes and does not begin with solid: it is no STL file, or cut "
                            "short.");
    fail_mesh(name,
              "the name ends with " + in_quotes(extension) + "; .stl, .obj or .ply was expected.");
}

std::string length_text(double value) { return format_fixed(value, value < 1 ? 4 : 1); }

}  // namespace

void fail_mesh(const std::string& name, const std::string& message) {
    throw CliError(ExitCode::kInput, name + ": " + message);
}

void fail_mesh(const std::string& name, int line, const std::string& message) {
    fail_mesh(name + ":" + std::to_string(line), message);
}

bool WordReader::next_line(std::string_view& line, char comment) {
    if (bytes_.empty()) return false;
    const std::size_t end = std::min(bytes_.find('\n'), bytes_.size());
    line = bytes_.substr(0, end);
    bytes_.remove_prefix(std::min(end + 1, bytes_.size()));
    ++line_;
    if (comment != 0) line = line.substr(0, line.find(comment));
    line = trim(line);
    return true;
}

std::string_view WordReader::take_word(std::string_view& line) {
    line = trim(line);
    const std::size_t end = std::min(line.find_first_of(" \t"), line.size());
    const std::string_view word = line.substr(0, end);
    line = trim(line.substr(end));
    return word;
}

float WordReader::take_number(std::string_view& line, const char* what) const {
    const std::string_view word = take_word(line);
    const std::optional<double> value = parse_double(word);
    if (!value || !std::isfinite(static_cast<float>(*value)))
        fail(std::string(what) + ": " + in_quotes(word) + " is not a finite number.");
    return static_cast<float>(*value);
}

MeshFile read_ply_mesh(std::string_view bytes, const std::string& name) {
    PlyFile ply = read_ply(bytes, name);
    MeshFile mesh;
    std::array<const std::vector<double>*, 3> column{ply.find("x"), ply.find("y"), ply.find("z")};
    if (std::find(column.begin(), column.end(), nullptr) != column.end())
        fail_mesh(name, "the vertices have no x, y and z.");
    mesh.vertices.reserve(3 * ply.vertex_count);
    for (std::size_t i = 0; i < ply.vertex_count; ++i)
        for (const std::vector<double>* values : column) {
            const auto value = static_cast<float>((*values)[i]);
            if (!std::isfinite(value))
                fail_mesh(name,
                          "vertex " + std::to_string(i) + " has a coordinate that is not finite.");
            mesh.vertices.push_back(value);
        }
    mesh.triangles = std::move(ply.triangles);
    return mesh;
}

void check_triangle_count(const std::string& name, std::size_t count) {
    if (count > MeshFiles::kMaxTriangles)
        fail_mesh(name, "the file has " + std::to_string(count) + " triangles or more; " +
                            std::to_string(MeshFiles::kMaxTriangles) +
                            " at most were expected: reduce the mesh.");
}

MeshFile MeshFile::part(const std::string& wanted) const {
    const auto found = std::find_if(parts.begin(), parts.end(),
                                    [&](const MeshPart& each) { return each.name == wanted; });
    if (found == parts.end()) {
        std::string names;
        for (const MeshPart& each : parts)
            names += (names.empty() ? "" : ", ") + printable(each.name);
        throw CliError(ExitCode::kUsage, "the model has no part '" + printable(wanted) +
                                             "'; it has " +
                                             (names.empty() ? "no named parts" : names) + ".");
    }
    MeshFile made;
    made.vertices = vertices;
    const auto first = triangles.begin() + static_cast<std::ptrdiff_t>(3 * found->first_triangle);
    made.triangles.assign(first, first + static_cast<std::ptrdiff_t>(3 * found->triangle_count));
    return made;
}

MeshFile read_mesh_file(const std::filesystem::path& path) {
    const std::string bytes = read_file(path, MeshFiles::kMaxBytes, ExitCode::kInput);
    MeshFile mesh = from_bytes(bytes, path);
    if (mesh.triangles.empty())
        fail_mesh(path.string(),
                  "the file has no triangles; the surface of an organ was expected.");
    return mesh;
}

void to_millimetres(MeshFile& mesh, std::optional<MeshUnit> unit, const std::string& path) {
    std::array<float, 3> low, high;
    low.fill(std::numeric_limits<float>::infinity());
    high.fill(-std::numeric_limits<float>::infinity());
    for (const std::uint32_t vertex : mesh.triangles)
        for (std::size_t axis = 0; axis < 3; ++axis) {
            low[axis] = std::min(low[axis], mesh.vertices[3 * std::size_t{vertex} + axis]);
            high[axis] = std::max(high[axis], mesh.vertices[3 * std::size_t{vertex} + axis]);
        }
    double side = 0;
    for (std::size_t axis = 0; axis < 3; ++axis)
        side = std::max(side, double{high[axis]} - low[axis]);
    const bool is_metres = !unit && side >= MeshFiles::kMinMetres && side <= MeshFiles::kMaxMetres;
    const double scale = unit == MeshUnit::kMetre || is_metres ? 1000
                         : unit == MeshUnit::kCentimetre       ? 10
                                                               : 1;
    const double min_side = unit ? MeshFiles::kMinSideOfUnit : MeshFiles::kMinSide;
    if (side * scale < min_side || side * scale > MeshFiles::kMaxSide)
        fail_mesh(path, "the longest side of the model is " + length_text(side) +
                            (unit ? " in the unit that was given, which is " : ", which is ") +
                            length_text(side * scale) + " mm; " + length_text(min_side) + " to " +
                            length_text(MeshFiles::kMaxSide) + " mm were expected. " +
                            (unit ? "If another unit is meant, give it as" : "Give its unit as") +
                            " --unit mm, cm or m.");
    if (is_metres)
        mesh.notes.push_back("The model is taken to be in metres: its longest side is " +
                             length_text(side) + ". Give --unit to say otherwise.");
    for (float& value : mesh.vertices) value = static_cast<float>(scale * value);
}

}  // namespace defrec::cli
