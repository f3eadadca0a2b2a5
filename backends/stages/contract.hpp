// How a stage's contract names its buffers. Each is listed once, and from the list come the sizes
// that a host asks for, the checks of a run, and its typed views. A stage's list is a struct of
// pointers with
//
//     static constexpr const char* kName;                                  // for error messages
//     template <class List> void list(List& list, const Sizes& sizes);
//
// where list calls list.input(name, pointer, count), list.output(...) or their optional_ forms, in
// the order of docs/stages.md. Optional buffers come after the required ones; their pointer is
// nullptr where they are not given.
#pragma once
#include <algorithm>
#include <array>

#include "backends/shared/glsl.h"
#include "backends/shared/stage.hpp"
#include "backends/stages/list.hpp"

namespace defrec {

// What a stage asks of one buffer.
struct BufferRule {
    const char* name = "";
    uint64_t bytes = 0;  // at least
    bool optional = false;
};

// Rules for a stage's inputs, or for its outputs.
class BufferRules {
  public:
    void add(const BufferRule& rule) { rules_.at(count_++) = rule; }
    std::span<const BufferRule> all() const { return std::span(rules_).first(count_); }
    // 0 for a buffer that the stage does not have.
    uint64_t bytes(size_t index) const { return index < count_ ? rules_[index].bytes : 0; }

  private:
    std::array<BufferRule, kMaxStageBuffers> rules_;
    size_t count_ = 0;
};

struct BufferTable {
    BufferRules inputs, outputs;
};

namespace detail {

// Writes the table of a list.
class TableWriter {
  public:
    explicit TableWriter(BufferTable& table) : table_(table) {}
    template <class T>
    void input(const char* name, const T*&, uint64_t count) {
        table_.inputs.add({name, count * sizeof(T), false});
    }
    template <class T>
    void optional_input(const char* name, const T*&, uint64_t count) {
        table_.inputs.add({name, count * sizeof(T), true});
    }
    template <class T>
    void output(const char* name, T*&, uint64_t count) {
        table_.outputs.add({name, count * sizeof(T), false});
    }
    template <class T>
    void optional_output(const char* name, T*&, uint64_t count) {
        table_.outputs.add({name, count * sizeof(T), true});
    }

  private:
    BufferTable& table_;
};

// Sets the pointers of a list.
class ViewWriter {
  public:
    ViewWriter(std::span<const InBuffer> in, std::span<const OutBuffer> out) : in_(in), out_(out) {}
    template <class T>
    void input(const char*, const T*& view, uint64_t) {
        view = next_in_ < in_.size() ? in_[next_in_].as<T>() : nullptr;
        ++next_in_;
    }
    template <class T>
    void optional_input(const char* name, const T*& view, uint64_t count) {
        input(name, view, count);
    }
    template <class T>
    void output(const char*, T*& view, uint64_t) {
        view = next_out_ < out_.size() ? out_[next_out_].as<T>() : nullptr;
        ++next_out_;
    }
    template <class T>
    void optional_output(const char* name, T*& view, uint64_t count) {
        output(name, view, count);
    }

  private:
    std::span<const InBuffer> in_;
    std::span<const OutBuffer> out_;
    size_t next_in_ = 0, next_out_ = 0;
};

template <class Buffer>
void check_buffers(const char* stage, const char* kind, const BufferRules& rules,
                   std::span<const Buffer> given) {
    const auto refuse = [stage](const std::string& text) {
        throw StageError(DEFREC_ERROR_ARGUMENT, std::string(stage) + ": " + text);
    };
    size_t required = 0;
    for (const BufferRule& rule : rules.all()) required += !rule.optional;
    if (given.size() < required || given.size() > rules.all().size())
        refuse(std::to_string(given.size()) + " " + kind + " given, " + std::to_string(required) +
               " to " + std::to_string(rules.all().size()) + " expected");
    for (size_t i = 0; i < given.size(); ++i) {
        const BufferRule& rule = rules.all()[i];
        const Buffer& buffer = given[i];
        if (buffer.data == nullptr && rule.optional) continue;
        if (buffer.data == nullptr && buffer.size != 0)
            refuse(std::string(rule.name) + " is NULL with a size of " +
                   std::to_string(buffer.size) + " bytes");
        if (buffer.size < rule.bytes)
            refuse(std::string(rule.name) + " has " + std::to_string(buffer.size) + " bytes, " +
                   std::to_string(rule.bytes) + " are needed");
    }
}

}  // namespace detail

template <class Buffers, class Sizes>
BufferTable table_of(const Sizes& sizes) {
    BufferTable table;
    detail::TableWriter writer(table);
    Buffers{}.list(writer, sizes);
    return table;
}

// The views of given buffers. Throws StageError where one is missing, superfluous or too small.
// Allocates only then.
template <class Buffers, class Sizes>
Buffers view_buffers(const Sizes& sizes, std::span<const InBuffer> in,
                     std::span<const OutBuffer> out = {}) {
    const BufferTable table = table_of<Buffers>(sizes);
    detail::check_buffers(Buffers::kName, "inputs", table.inputs, in);
    detail::check_buffers(Buffers::kName, "outputs", table.outputs, out);
    Buffers buffers{};
    detail::ViewWriter writer(in, out);
    buffers.list(writer, sizes);
    return buffers;
}

// The records of prepare's only buffer: as many as it holds, at most max_count.
template <class T>
std::span<const T> view_records(const char* stage, size_t max_count, std::span<const InBuffer> in) {
    BufferRules rules;
    rules.add({"records"});
    detail::check_buffers(stage, "inputs", rules, in);
    return {in[0].as<T>(), std::min<size_t>(max_count, in[0].size / sizeof(T))};
}

// Elements of an image buffer: the last row may end with its last pixel.
constexpr uint64_t image_elements(uint64_t width, uint64_t height, uint64_t stride) {
    return height == 0 ? 0 : stride * (height - 1) + width;
}

}  // namespace defrec
