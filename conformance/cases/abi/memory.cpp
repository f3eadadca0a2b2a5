// Memory of the host that the device copies to and from directly, and memory of the caller's as
// buffers. A plugin need not have them; one that lacks them passes.
#include <algorithm>
#include <utility>

#include "conformance/cases/abi/abi.hpp"

namespace defrec::conformance {
namespace {

constexpr uint32_t kNoKind = 1000;

// Memory of host_alloc.
class HostMemory {
  public:
    HostMemory(const Session& session, uint64_t size) : session_(session), size_(size) {
        session.check("host_alloc", session.table().host_alloc(session.device(), size, &memory_));
        require(memory_ != nullptr, "host_alloc of ", size, " bytes succeeded without memory");
    }
    ~HostMemory() { session_.table().host_free(session_.device(), memory_); }
    HostMemory(const HostMemory&) = delete;
    HostMemory& operator=(const HostMemory&) = delete;

    std::span<std::byte> bytes() const { return {static_cast<std::byte*>(memory_), size_}; }

  private:
    const Session& session_;
    void* memory_ = nullptr;
    uint64_t size_;
};

bool lends_memory(const Session& session) {
    const defrec_plugin& table = session.table();
    const bool allocates = DEFREC_HAS(&table, host_alloc), frees = DEFREC_HAS(&table, host_free);
    require(allocates == frees, "of host_alloc and host_free there is one without the other");
    return allocates;
}

void host_memory(CaseRun& run) {
    const Session& session = run.subject();
    if (!lends_memory(session)) return;
    Queue queue(session);
    for (const uint64_t size : {1u, 65u, 4096u, 100003u, 1u << 20}) {
        const HostMemory lent(session, size);
        const std::span<std::byte> bytes = lent.bytes();
        require(reinterpret_cast<uintptr_t>(bytes.data()) % 64 == 0,
                "host_alloc gave memory that does not begin at a multiple of 64");
        require(
            std::all_of(bytes.begin(), bytes.end(), [](std::byte b) { return b == std::byte{0}; }),
            "new memory of host_alloc is not zero");
        const Buffer buffer(session, size);
        const Bytes sent = pattern_bytes(size, size);
        queue.write(buffer, sent);
        queue.read(buffer, bytes);
        queue.finish();
        require(std::equal(bytes.begin(), bytes.end(), sent.begin()), "a read of ", size,
                " bytes into lent memory gave others");
        queue.write(buffer, bytes);
        std::fill(bytes.begin(), bytes.end(), std::byte{0});  // a plain write has read it
        queue.read(buffer, bytes);
        queue.finish();
        require(std::equal(bytes.begin(), bytes.end(), sent.begin()),
                "write had not read its source in lent memory when it returned");
    }
    void* beyond = nullptr;
    require_refused(session, concat("host_alloc of ", UINT64_MAX, " bytes"),
                    session.table().host_alloc(session.device(), UINT64_MAX, &beyond));
    require(beyond == nullptr, "host_alloc refused, but wrote its output");
}

// A frame's pixels: written from the same memory again and again, between other work.
void write_in_place(CaseRun& run) {
    const Session& session = run.subject();
    const defrec_plugin& table = session.table();
    if (!DEFREC_HAS(&table, write_in_place)) return;
    require(lends_memory(session),
            "write_in_place is there, and no host_alloc to get its memory from");
    constexpr uint64_t kSize = 70001, kOffset = 13;
    Queue queue(session);
    const HostMemory first(session, kSize), second(session, kSize);
    const Buffer buffer(session, kSize + kOffset);
    for (uint64_t round = 0; round < 4; ++round) {
        const Bytes sent = pattern_bytes(kSize, round), other = pattern_bytes(kSize, 100 + round);
        std::copy(sent.begin(), sent.end(), first.bytes().begin());
        std::copy(other.begin(), other.end(), second.bytes().begin());
        Bytes back(kSize), back_other(kSize);
        session.check("write_in_place", table.write_in_place(queue.get(), buffer.get(), kOffset,
                                                             first.bytes().data(), kSize));
        queue.read(buffer, back, kOffset);
        session.check("write_in_place", table.write_in_place(queue.get(), buffer.get(), kOffset,
                                                             second.bytes().data(), kSize));
        queue.read(buffer, back_other, kOffset);
        queue.finish();
        require(back == sent, "write_in_place gave the buffer other bytes than its source has");
        require(back_other == other,
                "a second write_in_place gave the buffer other bytes than its source has");
    }
    for (const auto& [offset, size] :
         {std::pair<uint64_t, uint64_t>{kOffset + 1, kSize}, {UINT64_MAX, 2}, {0, UINT64_MAX}})
        require_refused(
            session,
            concat("write_in_place of ", size, " bytes at ", offset, " to a buffer of ",
                   kSize + kOffset),
            table.write_in_place(queue.get(), buffer.get(), offset, first.bytes().data(), size));
}

void require_import_refused(const Session& session, const char* what, uint32_t kind, void* memory,
                            uint64_t size, bool unsupported) {
    defrec_pbuffer* buffer = nullptr;
    const defrec_status status =
        session.table().buffer_import(session.device(), kind, memory, size, &buffer);
    require_refused(session, concat("buffer_import of ", what), status);
    const defrec_status expected = unsupported ? DEFREC_ERROR_UNSUPPORTED : DEFREC_ERROR_ARGUMENT;
    require(status == expected, "buffer_import of ", what, " answered ", defrec_status_name(status),
            ", ", defrec_status_name(expected), " expected");
    require(buffer == nullptr, "buffer_import of ", what, " refused, but wrote its output");
}

void buffer_import(CaseRun& run) {
    const Session& session = run.subject();
    const defrec_plugin& table = session.table();
    if (!DEFREC_HAS(&table, buffer_import)) return;
    constexpr uint64_t kSize = 4096;
    alignas(64) static std::byte memory[kSize];
    const bool on_cuda = session.info().kind == DEFREC_DEVICE_CUDA;
    require_import_refused(session, "a kind that there is not", kNoKind, memory, kSize, true);
    require_import_refused(session, "memory of the host as that of a CUDA device",
                           DEFREC_MEMORY_CUDA, memory, kSize, !on_cuda);
    const uint32_t kind = on_cuda ? DEFREC_MEMORY_CUDA : DEFREC_MEMORY_HOST;
    defrec_pbuffer* buffer = nullptr;
    if (!on_cuda) {
        const defrec_status status =
            table.buffer_import(session.device(), kind, memory, kSize, &buffer);
        if (status == DEFREC_ERROR_UNSUPPORTED) return;
        session.check("buffer_import", status);
    }
    require_import_refused(session, "NULL", kind, nullptr, kSize, false);
    require_import_refused(session, "an address that is no multiple of 16", kind, memory + 8,
                           kSize - 8, false);
    require_import_refused(session, "no bytes", kind, memory, 0, false);
    require_import_refused(session, "more bytes than there are addresses", kind, memory, UINT64_MAX,
                           false);
    if (buffer == nullptr) return;

    Queue queue(session);
    const Bytes before = pattern_bytes(kSize, 1), after = pattern_bytes(kSize / 2, 2);
    std::copy(before.begin(), before.end(), memory);
    Bytes back(kSize);
    session.check("read", table.read(queue.get(), buffer, 0, back.data(), kSize));
    session.check("write", table.write(queue.get(), buffer, kSize / 2, after.data(), kSize / 2));
    queue.finish();
    table.buffer_destroy(buffer);
    require(back == before, "an imported buffer does not read as the memory it is made of");
    require(
        std::equal(before.begin(), before.begin() + kSize / 2, memory) &&
            std::equal(after.begin(), after.end(), memory + kSize / 2),
        "what was written to an imported buffer is not in the memory it is made of, or more is");
}

}  // namespace

void add_abi_memory_cases(std::vector<Case>& cases) {
    add_abi_case(cases, "host_memory",
                 "Memory that a plugin lends is zero and aligned, and is written from and read "
                 "into like any other.",
                 host_memory);
    add_abi_case(cases, "write_in_place",
                 "Writes in place bring what their source has, in the queue's order, and are "
                 "refused beyond the buffer.",
                 write_in_place);
    add_abi_case(cases, "buffer_import",
                 "Imported memory is worked in where it lies; what cannot be imported is refused "
                 "with the status that says why.",
                 buffer_import);
}

}  // namespace defrec::conformance
