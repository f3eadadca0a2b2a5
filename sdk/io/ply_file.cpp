// See ply_file.hpp. The format as Greg Turk's PLY polygon file format (1994) describes it.
#include "sdk/io/ply_file.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>

#include "sdk/io/decisions.hpp"
#include "sdk/io/mesh_formats.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

using decisions::MeshFiles;

struct Type {
    std::array<std::string_view, 2> names;
    std::size_t size;
    bool is_float, is_signed;
};
constexpr std::array<Type, 8> kTypes = {{{{"char", "int8"}, 1, false, true},
                                         {{"uchar", "uint8"}, 1, false, false},
                                         {{"short", "int16"}, 2, false, true},
                                         {{"ushort", "uint16"}, 2, false, false},
                                         {{"int", "int32"}, 4, false, true},
                                         {{"uint", "uint32"}, 4, false, false},
                                         {{"float", "float32"}, 4, true, true},
                                         {{"double", "float64"}, 8, true, true}}};

struct Property {
    std::string name;
    const Type* type = nullptr;
    const Type* count_type = nullptr;  // of a list
};
struct Element {
    std::string name;
    std::size_t count = 0;
    std::vector<Property> properties;
};
enum class Format { kText, kLittle, kBig };

template <class Number>
double number_from(const unsigned char* bytes) {
    Number number;
    std::memcpy(&number, bytes, sizeof number);
    return static_cast<double>(number);
}

double number_of(const Type& type, const unsigned char* bytes) {
    if (type.is_float)
        return type.size == sizeof(float) ? number_from<float>(bytes) : number_from<double>(bytes);
    switch (type.size) {
        case 1:
            return type.is_signed ? number_from<std::int8_t>(bytes)
                                  : number_from<std::uint8_t>(bytes);
        case 2:
            return type.is_signed ? number_from<std::int16_t>(bytes)
                                  : number_from<std::uint16_t>(bytes);
        default:
            return type.is_signed ? number_from<std::int32_t>(bytes)
                                  : number_from<std::uint32_t>(bytes);
    }
}

class Reader {
  public:
    Reader(std::string_view bytes, const std::string& name) : bytes_(bytes), name_(name) {}

    PlyFile read() {
        read_header();
        PlyFile file;
        for (const Element& element : elements_) {
            if (element.name == "vertex")
                read_vertices(element, file);
            else if (element.name == "face")
                read_faces(element, file);
            else
                skip(element);
        }
        const std::size_t rest =
            format_ == Format::kText ? trim_end(bytes_.substr(at_)).size() : bytes_.size() - at_;
        if (rest > 0)
            fail_mesh(name_, std::to_string(rest) +
                                 " bytes follow the last element that the header names; none were "
                                 "expected.");
        for (const std::uint32_t vertex : file.triangles)
            if (vertex >= file.vertex_count)
                fail_mesh(name_, "a face has vertex " + std::to_string(vertex) +
                                     "; less than the number of vertices, " +
                                     std::to_string(file.vertex_count) + ", was expected.");
        return file;
    }

  private:
    static std::string_view trim_end(std::string_view text) {
        while (!text.empty() && static_cast<unsigned char>(text.back()) <= ' ')
            text.remove_suffix(1);
        return text;
    }

    std::string_view header_line() {
        const std::size_t end = bytes_.find('\n', at_);
        if (end == std::string_view::npos || end - at_ > MeshFiles::kMaxLine)
            fail_mesh(name_, line_ + 1,
                      "the header of a PLY file was expected, which ends with end_header.");
        const std::string_view text = trim(bytes_.substr(at_, end - at_));
        at_ = end + 1;
        ++line_;
        return text;
    }

    const Type& type_of(std::string_view name) const {
        for (const Type& type : kTypes)
            if (type.names[0] == name || type.names[1] == name) return type;
        fail_mesh(name_, line_,
                  in_quotes(name) +
                      " is no type; char, uchar, short, ushort, int, uint, float or double was "
                      "expected.");
    }

    void read_header() {
        if (header_line() != "ply")
            fail_mesh(name_, 1, "a PLY file was expected, which begins with ply.");
        bool has_format = false;
        while (true) {
            std::string_view line = header_line();
            const std::string_view key = WordReader::take_word(line);
            if (key == "end_header") break;
            if (key == "format") {
                const std::string_view format = WordReader::take_word(line);
                if (format != "ascii" && format != "binary_little_endian" &&
                    format != "binary_big_endian")
                    fail_mesh(name_, line_,
                              "format " + in_quotes(format) +
                                  " is not known; ascii, binary_little_endian or "
                                  "binary_big_endian was expected.");
                format_ = format == "ascii"                  ? Format::kText
                          : format == "binary_little_endian" ? Format::kLittle
                                                             : Format::kBig;
                has_format = true;
            } else if (key == "element") {
                read_element(line);
            } else if (key == "property") {
                read_property(line);
            } else if (key != "comment" && key != "obj_info" && !key.empty()) {
                fail_mesh(name_, line_, in_quotes(key) + " is not known.");
            }
        }
        if (!has_format) fail_mesh(name_, line_, "the header names no format.");
    }

    void read_element(std::string_view line) {
        Element element;
        element.name = WordReader::take_word(line);
        const auto count = parse_integer(WordReader::take_word(line));
        if (!count || *count < 0 || *count > static_cast<std::int64_t>(MeshFiles::kMaxVertices))
            fail_mesh(name_, line_,
                      "element " + printable(element.name.substr(0, 40)) +
                          ": a number of at most " + std::to_string(MeshFiles::kMaxVertices) +
                          " was expected.");
        element.count = static_cast<std::size_t>(*count);
        if (element.name == "face") check_triangle_count(name_, element.count);
        const auto is_vertex = [](const Element& each) { return each.name == "vertex"; };
        if (is_vertex(element) && std::any_of(elements_.begin(), elements_.end(), is_vertex))
            fail_mesh(name_, line_, "element vertex stands here again; one was expected.");
        elements_.push_back(std::move(element));
    }

    void read_property(std::string_view line) {
        if (elements_.empty()) fail_mesh(name_, line_, "a property stands before any element.");
        std::vector<Property>& properties = elements_.back().properties;
        if (properties.size() >= MeshFiles::kMaxColumns)
            fail_mesh(
                name_, line_,
                std::to_string(MeshFiles::kMaxColumns) + " properties at most were expected.");
        Property property;
        std::string_view type = WordReader::take_word(line);
        if (type == "list") {
            property.count_type = &type_of(WordReader::take_word(line));
            type = WordReader::take_word(line);
        }
        property.type = &type_of(type);
        property.name = WordReader::take_word(line);
        properties.push_back(std::move(property));
    }

    double take(const Type& type) {
        if (format_ == Format::kText) return take_text();
        if (bytes_.size() - at_ < type.size) fail_short();
        std::array<unsigned char, 8> bytes{};
        std::memcpy(bytes.data(), bytes_.data() + at_, type.size);
        at_ += type.size;
        if ((format_ == Format::kBig) != (std::endian::native == std::endian::big))
            std::reverse(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(type.size));
        return number_of(type, bytes.data());
    }

    double take_text() {
        const auto is_blank = [](char c) { return static_cast<unsigned char>(c) <= ' '; };
        while (at_ < bytes_.size() && is_blank(bytes_[at_])) line_ += bytes_[at_++] == '\n';
        std::size_t end = at_;
        while (end < bytes_.size() && !is_blank(bytes_[end])) ++end;
        if (end == at_) fail_short();
        const std::string_view word = bytes_.substr(at_, end - at_);
        at_ = end;
        const std::optional<double> value = parse_double(word);
        if (value) return *value;
        if (word == "nan" || word == "-nan" || word == "inf" || word == "-inf")
            return std::numeric_limits<double>::quiet_NaN();
        fail_mesh(name_, line_ + 1, in_quotes(word) + " is not a number.");
    }

    std::size_t take_count(const Property& property) {
        const double count = take(*property.count_type);
        if (!(count >= 0 && count <= static_cast<double>(MeshFiles::kMaxCorners)))
            fail_mesh(name_, "a list of " + property.name + " has a length that is not 0.." +
                                 std::to_string(MeshFiles::kMaxCorners) + ".");
        return static_cast<std::size_t>(count);
    }

    [[noreturn]] void fail_short() const {
        fail_mesh(name_,
                  "the file is cut short: it ends before the last element that its header "
                  "names.");
    }

    void read_vertices(const Element& element, PlyFile& file) {
        file.vertex_count = element.count;
        std::size_t size = 0;
        for (const Property& property : element.properties)
            size += (property.count_type == nullptr ? property.type : property.count_type)->size;
        // Nothing is allocated that the file cannot hold: a number takes two characters or more.
        const std::size_t least = format_ == Format::kText ? 2 * element.properties.size() : size;
        if (element.count > 0 && (bytes_.size() - at_) / element.count < least / 2) fail_short();
        for (const Property& property : element.properties) {
            if (property.count_type != nullptr) continue;
            file.names.push_back(property.name);
            file.values.emplace_back(element.count);
        }
        for (std::size_t i = 0; i < element.count; ++i) {
            std::size_t column = 0;
            for (const Property& property : element.properties) {
                if (property.count_type == nullptr)
                    file.values[column++][i] = take(*property.type);
                else
                    skip_list(property);
            }
        }
    }

    void read_faces(const Element& element, PlyFile& file) {
        for (std::size_t i = 0; i < element.count; ++i)
            for (const Property& property : element.properties) {
                if (property.count_type == nullptr) {
                    take(*property.type);
                } else if (property.name == "vertex_indices" || property.name == "vertex_index") {
                    read_face(property, file.triangles);
                } else {
                    skip_list(property);
                }
            }
    }

    // A fan about the first corner.
    void read_face(const Property& property, std::vector<std::uint32_t>& triangles) {
        const std::size_t count = take_count(property);
        std::array<std::uint32_t, 3> corner{};
        for (std::size_t i = 0; i < count; ++i) {
            const double index = take(*property.type);
            if (!(index >= 0 && index < static_cast<double>(MeshFiles::kMaxVertices)))
                fail_mesh(name_, "a face has a vertex that there is not.");
            if (i > 2) corner[1] = corner[2];
            corner[std::min<std::size_t>(i, 2)] = static_cast<std::uint32_t>(index);
            if (i >= 2) triangles.insert(triangles.end(), corner.begin(), corner.end());
        }
        check_triangle_count(name_, triangles.size() / 3);
    }

    void skip_list(const Property& property) {
        for (std::size_t left = take_count(property); left > 0; --left) take(*property.type);
    }
    void skip(const Element& element) {
        for (std::size_t i = 0; i < element.count; ++i)
            for (const Property& property : element.properties) {
                if (property.count_type != nullptr)
                    skip_list(property);
                else
                    take(*property.type);
            }
    }

    std::string_view bytes_;
    const std::string& name_;
    std::size_t at_ = 0;
    int line_ = 0;
    Format format_ = Format::kText;
    std::vector<Element> elements_;
};

}  // namespace

const std::vector<double>* PlyFile::find(std::string_view column) const {
    const auto found = std::find(names.begin(), names.end(), column);
    return found == names.end() ? nullptr
                                : &values[static_cast<std::size_t>(found - names.begin())];
}

PlyFile read_ply(std::string_view bytes, const std::string& name) {
    return Reader(bytes, name).read();
}

}  // namespace defrec::cli
