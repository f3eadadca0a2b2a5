// See placed_model.hpp.
#include "sdk/registration/program/placed_model.hpp"

#include <string>

#include "sdk/base/os/atomic_file.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

constexpr int kDigits = 4;  // of a mm

// Three coordinates and an error.
std::string numbers(const double* xyz, double error, const char* between) {
    std::string text;
    for (int axis = 0; axis < 3; ++axis) text += format_fixed(xyz[axis], kDigits) + between;
    return text + format_fixed(error, kDigits);
}

// A name as a field of CSV (RFC 4180).
std::string field(const std::string& name) {
    const std::string shown = printable(name);
    if (shown.find_first_of(",\"") == std::string::npos) return shown;
    std::string text = "\"";
    for (const char letter : shown)
        text += letter == '"' ? std::string("\"\"") : std::string(1, letter);
    return text + "\"";
}

}  // namespace

PlacedModel placed_model(const RegisterFindings& findings, const MeshFile& model) {
    PlacedModel placed;
    placed.xyz.assign(model.vertices.begin(), model.vertices.end());
    placed.expected_error_mm.resize(placed.xyz.size() / 3);
    require(defrec_registration_move_points(findings.found.handle.get(), placed.xyz.data(),
                                            placed.expected_error_mm.size(), placed.xyz.data(),
                                            nullptr, placed.expected_error_mm.data()),
            ExitCode::kInternal, "moving the model");
    return placed;
}

void write_model(const std::filesystem::path& path, const PlacedModel& placed,
                 const MeshFile& model) {
    const std::size_t vertices = placed.expected_error_mm.size(),
                      triangles = model.triangles.size() / 3;
    std::string text = "ply\nformat ascii 1.0\nelement vertex " + std::to_string(vertices) +
                       "\nproperty float x\nproperty float y\nproperty float z\n"
                       "property float expected_error_mm\nelement face " +
                       std::to_string(triangles) +
                       "\nproperty list uchar uint vertex_indices\nend_header\n";
    for (std::size_t i = 0; i < vertices; ++i)
        text += numbers(&placed.xyz[3 * i], placed.expected_error_mm[i], " ") + "\n";
    for (std::size_t i = 0; i < model.triangles.size(); i += 3)
        text += "3 " + std::to_string(model.triangles[i]) + " " +
                std::to_string(model.triangles[i + 1]) + " " +
                std::to_string(model.triangles[i + 2]) + "\n";
    write_atomically(path, text);
}

void write_targets(const std::filesystem::path& path, const RegisterFindings& findings) {
    std::string text = "name,x,y,z,expected_error_mm\n";
    for (const ModelTarget& target : findings.targets) {
        const MovedTarget at = moved(findings, target);
        text +=
            field(target.name) + "," + numbers(at.place.data(), at.expected_error_mm, ",") + "\n";
    }
    write_atomically(path, text);
}

}  // namespace defrec::cli
