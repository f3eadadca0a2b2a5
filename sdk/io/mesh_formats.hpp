// The formats of mesh_file.hpp, each from the bytes of a file.
#pragma once

#include <string>
#include <string_view>

#include "sdk/io/exit_code.hpp"
#include "sdk/io/mesh_file.hpp"
#include "sdk/io/ply_file.hpp"

namespace defrec::cli {

// Throws CliError(kInput), "NAME: message".
[[noreturn]] void fail_mesh(const std::string& name, const std::string& message);
// Likewise, "NAME:LINE: message".
[[noreturn]] void fail_mesh(const std::string& name, int line, const std::string& message);

// Takes words apart, without copies.
class WordReader {
  public:
    WordReader(std::string_view bytes, std::string name) : bytes_(bytes), name_(std::move(name)) {}

    // The next line without comment and surrounding blanks, which may be empty; false at the end.
    // comment: from this character on a line is left out; 0: none.
    bool next_line(std::string_view& line, char comment);
    // Takes the first word of a line; empty at its end.
    static std::string_view take_word(std::string_view& line);
    // Takes a finite number that a float holds. what: names it in the message.
    float take_number(std::string_view& line, const char* what) const;

    int line() const { return line_; }
    [[noreturn]] void fail(const std::string& message) const { fail_mesh(name_, line_, message); }

  private:
    std::string_view bytes_;
    std::string name_;
    int line_ = 0;
};

// Throws for more triangles than are taken.
void check_triangle_count(const std::string& name, std::size_t count);

bool is_binary_stl(std::string_view bytes);
MeshFile read_binary_stl(std::string_view bytes, const std::string& name);
MeshFile read_text_stl(std::string_view bytes, const std::string& name);
MeshFile read_obj(std::string_view bytes, const std::string& name);
MeshFile read_ply_mesh(std::string_view bytes, const std::string& name);

}  // namespace defrec::cli
