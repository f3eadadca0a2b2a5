// STL of mesh_file.hpp: triangles without indices, whose vertices are put together.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <optional>
#include <unordered_map>

#include "sdk/io/mesh_formats.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

constexpr std::size_t kHeader = 84, kFacet = 50;  // bytes

std::uint32_t count_of(std::string_view bytes) {
    std::uint32_t count = 0;
    for (std::size_t i = 4; i-- > 0;)
        count = count << 8 | static_cast<unsigned char>(bytes[kHeader - 4 + i]);
    return count;
}

float float_at(std::string_view bytes, std::size_t at) {
    std::uint32_t bits = 0;
    for (std::size_t i = 4; i-- > 0;) bits = bits << 8 | static_cast<unsigned char>(bytes[at + i]);
    float value;
    std::memcpy(&value, &bits, sizeof value);
    return value;
}

// Gives vertices at one place one index.
class VertexIndex {
  public:
    explicit VertexIndex(MeshFile& mesh) : mesh_(mesh) {}

    void add(std::array<float, 3> place) {
        for (float& value : place) value += 0.0f;  // -0 and 0 are one place
        const auto next = static_cast<std::uint32_t>(mesh_.vertices.size() / 3);
        const auto [found, is_new] = index_.emplace(place, next);
        if (is_new) mesh_.vertices.insert(mesh_.vertices.end(), place.begin(), place.end());
        mesh_.triangles.push_back(found->second);
    }

  private:
    struct Hash {
        std::size_t operator()(const std::array<float, 3>& place) const {
            std::array<std::uint32_t, 3> bits;
            std::memcpy(bits.data(), place.data(), sizeof bits);
            std::uint64_t hash = 0;
            for (const std::uint32_t part : bits) hash = (hash ^ part) * 0x9E3779B97F4A7C15u;
            return static_cast<std::size_t>(hash ^ hash >> 32);
        }
    };
    MeshFile& mesh_;
    std::unordered_map<std::array<float, 3>, std::uint32_t, Hash> index_;
};

}  // namespace

// Some programs begin binary files with "solid" as well: the length decides.
bool is_binary_stl(std::string_view bytes) {
    if (bytes.size() < kHeader) return false;
    return bytes.size() == kHeader + kFacet * std::size_t{count_of(bytes)} ||
           !bytes.starts_with("solid");
}

MeshFile read_binary_stl(std::string_view bytes, const std::string& name) {
    const std::size_t count = count_of(bytes);
    check_triangle_count(name, count);
    if (bytes.size() != kHeader + kFacet * count)
        fail_mesh(name, "a binary STL file says that it has " + std::to_string(count) +
                            " triangles, which take " + std::to_string(kHeader + kFacet * count) +
                            " bytes; it has " + std::to_string(bytes.size()) +
                            ": it is cut short, or no STL, OBJ or PLY file.");
    MeshFile mesh;
    VertexIndex index(mesh);
    for (std::size_t i = 0; i < count; ++i)
        for (std::size_t corner = 0; corner < 3; ++corner) {
            std::array<float, 3> place;
            for (std::size_t axis = 0; axis < 3; ++axis)
                place[axis] = float_at(bytes, kHeader + kFacet * i + 12 * (corner + 1) + 4 * axis);
            if (!std::all_of(place.begin(), place.end(), [](float v) { return std::isfinite(v); }))
                fail_mesh(name, "triangle " + std::to_string(i) +
                                    " has a coordinate that is not finite.");
            index.add(place);
        }
    return mesh;
}

MeshFile read_text_stl(std::string_view bytes, const std::string& name) {
    MeshFile mesh;
    VertexIndex index(mesh);
    WordReader words(bytes, name);
    std::string_view line;
    bool is_open = false, is_in_facet = false;
    std::size_t corners = 0;
    while (words.next_line(line, 0)) {
        const std::string_view key = WordReader::take_word(line);
        if (key.empty() || key == "outer" || key == "endloop") continue;
        if (key == "solid") {
            if (is_open) words.fail("a solid begins before endsolid.");
            is_open = true;
            mesh.parts.push_back({std::string(line), mesh.triangles.size() / 3, 0});
        } else if (!is_open) {
            words.fail(in_quotes(key) + " stands outside of a solid.");
        } else if (key == "facet") {
            if (is_in_facet) words.fail("a facet begins before endfacet.");
            is_in_facet = true;
            corners = 0;
        } else if (key == "endsolid") {
            if (is_in_facet) words.fail("the solid ends before endfacet.");
            is_open = false;
        } else if (!is_in_facet && (key == "vertex" || key == "endfacet")) {
            words.fail(in_quotes(key) + " stands outside of a facet.");
        } else if (key == "vertex") {
            std::array<float, 3> place;
            for (float& value : place) value = words.take_number(line, "vertex");
            if (++corners > 3) words.fail("a facet has more than three vertices.");
            index.add(place);
        } else if (key == "endfacet") {
            if (corners != 3)
                words.fail("a facet has " + std::to_string(corners) +
                           " vertices; 3 were expected.");
            is_in_facet = false;
            ++mesh.parts.back().triangle_count;
            check_triangle_count(name, mesh.triangles.size() / 3);
        } else {
            words.fail(in_quotes(key) + " is not known in STL.");
        }
    }
    if (is_open) words.fail("the file is cut short: endsolid was expected.");
    if (mesh.parts.size() == 1) mesh.parts.clear();
    return mesh;
}

}  // namespace defrec::cli
