// What a call of the stub libdefrec does, and the log and the answers that all calls share.
#include "bindings/stub/stub_call.hpp"

#include <atomic>
#include <charconv>
#include <cstring>
#include <map>
#include <mutex>

namespace defrec::stub {
namespace {

struct Shared {
    std::mutex mutex;
    std::map<std::string, Answer> answers;
    std::string calls;
};
// Never destroyed: a binding's finalisers may call while the process ends.
Shared& shared() {
    static Shared* const all = new Shared;
    return *all;
}

thread_local std::string last_error;

template <typename... Arguments>
std::string number(Arguments... arguments) {
    char digits[64];
    return {digits, std::to_chars(digits, digits + sizeof digits, arguments...).ptr};
}

std::uint32_t struct_size_of(const void* value) {
    std::uint32_t size;
    std::memcpy(&size, value, sizeof size);
    return size;
}

}  // namespace

Call::Call(const char* function) : function_(function), line_(function_ + "(") {
    const std::lock_guard lock(shared().mutex);
    const auto found = shared().answers.find(function_);
    if (found != shared().answers.end()) answer_ = found->second;
}

Call::~Call() {
    const std::lock_guard lock(shared().mutex);
    shared().calls += line_ + ")\n";
}

void Call::add(const char* name, const std::string& value) {
    line_ += (has_arguments_ ? ", " : "") + std::string(name) + "=" + value;
    has_arguments_ = true;
}

bool Call::is_given(const char* name, const void* out) {
    if (out != nullptr && succeeds()) return true;
    add(name, out == nullptr ? "NULL" : "untouched");
    return false;
}

bool Call::is_given_structure(const char* name, const void* out) {
    add(name, out == nullptr ? "NULL" : std::string("{") + number(struct_size_of(out)) + "}");
    return out != nullptr && succeeds();
}

void Call::handle(const char* name, const void* value) {
    add(name, value == nullptr
                  ? "NULL"
                  : std::string("0x") + number(reinterpret_cast<std::uintptr_t>(value), 16));
}

void Call::text(const char* name, const char* value) {
    add(name, value == nullptr ? "NULL" : '"' + std::string(value) + '"');
}

void Call::structure(const char* name, const void* value) {
    if (value == nullptr) return add(name, "NULL");
    const std::uint32_t size = struct_size_of(value);
    std::string bytes;
    for (std::uint32_t i = 0; i < size; ++i) {
        const unsigned byte = static_cast<const unsigned char*>(value)[i];
        bytes += number(byte / 16, 16) + number(byte % 16, 16);
    }
    add(name, bytes);
}

void Call::doubles(const char* name, const double* values, std::size_t count) {
    add(name,
        values == nullptr ? "NULL" : list(count, [&](std::size_t i) { return number(values[i]); }));
}

std::string Call::buffer(const defrec_const_buffer& in) {
    return in.data == nullptr && in.size == 0 ? "NULL" : number(in.size);
}

// Wider than 32 bits, as the library's own.
std::uintptr_t Call::next_handle() {
    static std::atomic<std::uintptr_t> last{0xdef00001000};
    return ++last;
}

void Call::copy(const void* from, std::size_t size, void* to, std::uint32_t struct_size) {
    const std::size_t known = struct_size < size ? struct_size : size;
    if (known > sizeof struct_size) {
        std::memcpy(static_cast<char*>(to) + sizeof struct_size,
                    static_cast<const char*>(from) + sizeof struct_size,
                    known - sizeof struct_size);
    }
}

void Call::fill(defrec_plugin_info& info) {
    info.name = "plugin name";
    info.path = "plugin path";
    info.version = "plugin version";
    info.reason = "plugin reason";
}

void Call::fill(defrec_device_info& info) {
    info.id = "device id";
    info.name = "device name";
    info.driver = "device driver";
}

defrec_status Call::status() const {
    if (!succeeds()) last_error = answer_->message;
    return answer_ ? answer_->status : DEFREC_OK;
}

std::size_t Call::count() const { return answer_ ? static_cast<std::size_t>(answer_->status) : 0; }

std::uint32_t Call::version() const {
    return answer_ ? static_cast<std::uint32_t>(answer_->status)
                   : DEFREC_API_MAJOR * 1000 + DEFREC_API_MINOR;
}

const char* Call::message() const {
    if (function_ == "defrec_last_error") return last_error.c_str();
    thread_local std::string text;
    text = answer_ ? answer_->message : "stub";
    return text.c_str();
}

}  // namespace defrec::stub

using defrec::stub::shared;

void defrec_stub_answer(const char* function, int32_t status, const char* message) {
    const std::lock_guard lock(shared().mutex);
    shared().answers[function] = {status, message == nullptr ? "" : message};
}

const char* defrec_stub_calls(void) {
    thread_local std::string calls;
    calls.clear();
    const std::lock_guard lock(shared().mutex);
    calls.swap(shared().calls);
    return calls.c_str();
}

void defrec_stub_reset(void) {
    const std::lock_guard lock(shared().mutex);
    shared().answers.clear();
    shared().calls.clear();
}
