// One call of a function of the stub libdefrec: writes its arguments down, fills its outputs,
// answers. Used by stub.cpp, which is generated.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "bindings/stub/stub.h"

namespace defrec::stub {

struct Answer {
    std::int32_t status = DEFREC_OK;
    std::string message;
};

// The line is in the log when the call ends.
class Call {
  public:
    explicit Call(const char* function);
    ~Call();
    Call(const Call&) = delete;
    Call& operator=(const Call&) = delete;

    void integer(const char* name, std::int64_t value) { add(name, std::to_string(value)); }
    void integer(const char* name, std::uint64_t value) { add(name, std::to_string(value)); }
    void integer(const char* name, std::int32_t value) { add(name, std::to_string(value)); }
    void integer(const char* name, std::uint32_t value) { add(name, std::to_string(value)); }
    void handle(const char* name, const void* value);
    void text(const char* name, const char* value);
    // value begins with struct_size.
    void structure(const char* name, const void* value);
    void doubles(const char* name, const double* values, std::size_t count);
    template <typename Buffer>
    void buffers(const char* name, const Buffer* values, std::size_t count) {
        add(name, values == nullptr ? "NULL" : list(count, [&](std::size_t i) {
                return buffer(values[i]);
            }));
    }

    template <typename Handle>
    void made_handle(const char* name, Handle* out) {
        if (is_given(name, out)) {
            *out = reinterpret_cast<Handle>(next_handle());
            handle(name, *out);
        }
    }
    // Everything behind struct_size is zero, but texts that are never NULL.
    template <typename Struct>
    void made_structure(const char* name, Struct* out) {
        if (is_given_structure(name, out)) {
            Struct made{};
            fill(made);
            copy(&made, sizeof made, out, out->struct_size);
        }
    }
    // 1, 2, 3, ...
    template <typename Number>
    void made_array(const char* name, Number* out, std::size_t count) {
        if (is_given(name, out)) {
            add(name, "written");
            for (std::size_t i = 0; i < count; ++i) out[i] = static_cast<Number>(i + 1);
        }
    }

    defrec_status status() const;
    std::size_t count() const;
    std::uint32_t version() const;
    const char* message() const;

  private:
    bool succeeds() const { return !answer_ || answer_->status >= 0; }
    bool is_given(const char* name, const void* out);
    bool is_given_structure(const char* name, const void* out);
    void add(const char* name, const std::string& value);

    template <typename Describe>
    static std::string list(std::size_t count, Describe describe) {
        std::string text = "[";
        for (std::size_t i = 0; i < count; ++i) text.append(i == 0 ? "" : ", ").append(describe(i));
        return text.append("]");
    }
    static std::string buffer(const defrec_const_buffer& in);
    static std::string buffer(const defrec_buffer& out) {
        return buffer(defrec_const_buffer{out.data, out.size});
    }
    static std::uintptr_t next_handle();
    static void copy(const void* from, std::size_t size, void* to, std::uint32_t struct_size);
    static void fill(defrec_plugin_info& info);
    static void fill(defrec_device_info& info);
    template <typename Struct>
    static void fill(Struct&) {}

    std::string function_;
    std::string line_;
    bool has_arguments_ = false;
    std::optional<Answer> answer_;
};

}  // namespace defrec::stub
