// Wavefront OBJ of mesh_file.hpp: vertices, faces, and the groups that name parts. Materials,
// normals and texture coordinates are left out.
#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "sdk/io/decisions.hpp"
#include "sdk/io/mesh_formats.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

using decisions::MeshFiles;

constexpr std::string_view kUnnamed = "default";  // a group without a name

class Reader {
  public:
    Reader(std::string_view bytes, const std::string& name) : words_(bytes, name), name_(name) {}

    MeshFile read() {
        std::string_view line;
        while (words_.next_line(line, '#')) {
            const std::string_view key = WordReader::take_word(line);
            if (key == "v") {
                for (int axis = 0; axis < 3; ++axis)
                    mesh_.vertices.push_back(words_.take_number(line, "v"));
                if (vertex_count() > MeshFiles::kMaxVertices)
                    words_.fail("at most " + std::to_string(MeshFiles::kMaxVertices) +
                                " vertices were expected.");
            } else if (key == "f") {
                read_face(line);
            } else if (key == "o" || key == "g") {
                begin_part(line);
            }
        }
        // Vertices may stand after the faces that have them.
        for (const std::uint32_t vertex : mesh_.triangles)
            if (vertex >= vertex_count())
                fail_mesh(name_, "a face has vertex " + std::to_string(std::int64_t{vertex} + 1) +
                                     "; at most " + std::to_string(vertex_count()) +
                                     " was expected, the number of vertices.");
        return sorted();
    }

  private:
    std::size_t vertex_count() const { return mesh_.vertices.size() / 3; }

    void begin_part(std::string_view line) {
        const std::string part(line.empty() ? kUnnamed : line);
        const auto known = std::find(names_.begin(), names_.end(), part);
        part_ = static_cast<std::size_t>(known - names_.begin());
        if (known == names_.end()) {
            if (names_.size() == MeshFiles::kMaxParts)
                words_.fail("at most " + std::to_string(MeshFiles::kMaxParts) +
                            " groups were expected.");
            names_.push_back(part);
        }
    }

    // v, v/vt, v//vn or v/vt/vn, counted from 1, or from the last one backwards.
    std::uint32_t vertex_of(std::string_view word) const {
        const std::string_view first = word.substr(0, word.find('/'));
        const std::optional<std::int64_t> index = parse_integer(first);
        const auto count = static_cast<std::int64_t>(vertex_count());
        const std::int64_t vertex = !index       ? -1
                                    : *index > 0 ? *index - 1
                                    : *index < 0 ? count + *index
                                                 : -1;
        if (vertex < 0 || vertex >= static_cast<std::int64_t>(MeshFiles::kMaxVertices))
            words_.fail(in_quotes(word) + " is no vertex.");
        return static_cast<std::uint32_t>(vertex);
    }

    // A fan about the first corner.
    void read_face(std::string_view line) {
        std::array<std::uint32_t, 3> corner{};
        std::size_t count = 0;
        if (names_.empty()) names_.emplace_back(kUnnamed);
        for (std::string_view word = WordReader::take_word(line); !word.empty();
             word = WordReader::take_word(line), ++count) {
            if (count >= MeshFiles::kMaxCorners)
                words_.fail("a face of at most " + std::to_string(MeshFiles::kMaxCorners) +
                            " vertices was expected.");
            if (count > 2) corner[1] = corner[2];
            corner[std::min<std::size_t>(count, 2)] = vertex_of(word);
            if (count < 2) continue;
            mesh_.triangles.insert(mesh_.triangles.end(), corner.begin(), corner.end());
            parts_.push_back(static_cast<std::uint32_t>(part_));
        }
        if (count < 3) words_.fail("a face of at least 3 vertices was expected.");
        check_triangle_count(name_, parts_.size());
    }

    // A group may go on after another one: its triangles are put together.
    MeshFile sorted() {
        MeshFile made;
        made.vertices = std::move(mesh_.vertices);
        made.triangles.resize(mesh_.triangles.size());
        std::vector<std::size_t> next(names_.size() + 1);
        for (const std::uint32_t part : parts_) ++next[part + 1];
        for (std::size_t part = 0; part < names_.size(); ++part) {
            if (next[part + 1] > 0)
                made.parts.push_back({names_[part], next[part], next[part + 1]});
            next[part + 1] += next[part];
        }
        for (std::size_t i = 0; i < parts_.size(); ++i)
            std::copy_n(&mesh_.triangles[3 * i], 3, &made.triangles[3 * next[parts_[i]]++]);
        if (made.parts.size() == 1 && made.parts.front().name == kUnnamed) made.parts.clear();
        return made;
    }

    WordReader words_;
    const std::string& name_;
    MeshFile mesh_;
    std::vector<std::string> names_;
    std::vector<std::uint32_t> parts_;  // of each triangle
    std::size_t part_ = 0;
};

}  // namespace

MeshFile read_obj(std::string_view bytes, const std::string& name) {
    return Reader(bytes, name).read();
}

}  // namespace defrec::cli
