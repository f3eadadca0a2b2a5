// Buffers: contents, ranges, write and read.
#include <algorithm>

#include "conformance/cases/abi/abi.hpp"

namespace defrec::conformance {
namespace {

// Memory that was used before comes back as zero, too.
void zeroed(CaseRun& run) {
    Queue queue(run.subject());
    for (int round = 0; round < 3; ++round)
        for (const uint64_t size : {1u, 3u, 17u, 4096u, 100003u, 1u << 20}) {
            const Buffer buffer(run.subject(), size);
            Bytes found(size, std::byte{0xFF});
            queue.read(buffer, found);
            queue.finish();
            const auto other = std::find_if(found.begin(), found.end(),
                                            [](std::byte byte) { return byte != std::byte{0}; });
            require(other == found.end(), "byte ", other - found.begin(), " of a new buffer of ",
                    size, " bytes is not 0");
            queue.write(buffer, pattern_bytes(size, 5));
            queue.finish();
        }
}

void round_trip(CaseRun& run) {
    Queue queue(run.subject());
    for (const uint64_t size : {1u, 2u, 3u, 5u, 63u, 64u, 65u, 4095u, 70001u}) {
        const Buffer buffer(run.subject(), size);
        const Bytes sent = pattern_bytes(size, size);
        Bytes back(size);
        queue.write(buffer, sent);
        queue.read(buffer, back);
        queue.finish();
        require(back == sent, "what was written to a buffer of ", size,
                " bytes is not what is read from it");
    }
}

// Parts at odd places, in the middle of others.
void offsets(CaseRun& run) {
    constexpr uint64_t kSize = 1021;
    Queue queue(run.subject());
    const Buffer buffer(run.subject(), kSize);
    Bytes mirror(kSize), back(kSize);
    Random random = run.random();
    for (int i = 0; i < 60; ++i) {
        const uint32_t offset = random.below(kSize),
                       size = random.below(uint32_t(kSize - offset + 1));
        const Bytes part = pattern_bytes(size, uint64_t(i));
        queue.write(buffer, part, offset);
        std::copy(part.begin(), part.end(), mirror.begin() + offset);
    }
    queue.read(buffer, back);
    queue.finish();
    require(back == mirror, "writes at offsets left other bytes than those written");
    for (int i = 0; i < 60; ++i) {
        constexpr size_t kGuard = 64;
        const uint32_t offset = random.below(kSize),
                       size = random.below(uint32_t(kSize - offset + 1));
        Bytes into(size + 2 * kGuard, std::byte{0xA5});
        queue.read(buffer, std::span(into).subspan(kGuard, size), offset);
        queue.finish();
        require(std::equal(mirror.begin() + offset, mirror.begin() + offset + size,
                           into.begin() + kGuard),
                "a read of ", size, " bytes at ", offset,
                " gave other bytes than those that lie there");
        const bool intact = std::all_of(into.begin(), into.begin() + kGuard,
                                        [](std::byte b) { return b == std::byte{0xA5}; }) &&
                            std::all_of(into.end() - kGuard, into.end(),
                                        [](std::byte b) { return b == std::byte{0xA5}; });
        require(intact, "a read of ", size, " bytes at ", offset, " wrote beyond them");
    }
}

void source_read_at_once(CaseRun& run) {
    constexpr uint64_t kSize = 1 << 20;
    Queue queue(run.subject());
    const Buffer buffer(run.subject(), kSize);
    Bytes source = pattern_bytes(kSize, 9), back(kSize);
    const Bytes sent = source;
    queue.write(buffer, source);
    std::fill(source.begin(), source.end(), std::byte{0});
    queue.read(buffer, back);
    queue.finish();
    require(back == sent, "write had not read its source when it returned");
}

// Work of a queue happens in its order.
void in_order(CaseRun& run) {
    constexpr uint64_t kSize = 5003;
    Queue queue(run.subject());
    const Buffer buffer(run.subject(), kSize);
    std::vector<Bytes> back(20, Bytes(kSize));
    for (size_t i = 0; i < back.size(); ++i) {
        queue.write(buffer, pattern_bytes(kSize, i));
        queue.read(buffer, back[i]);
    }
    queue.finish();
    for (size_t i = 0; i < back.size(); ++i)
        require(back[i] == pattern_bytes(kSize, i), "read ", i,
                " did not give what the write before it wrote");
}

void ranges(CaseRun& run) {
    constexpr uint64_t kSize = 100;
    const Session& session = run.subject();
    const defrec_plugin& table = session.table();
    Queue queue(session);
    const Buffer buffer(session, kSize);
    const Bytes kept = pattern_bytes(kSize, 3);
    queue.write(buffer, kept);
    const std::pair<uint64_t, uint64_t> wrong[] = {
        {0, 101}, {1, 100}, {100, 1}, {101, 0}, {UINT64_MAX, 2}, {2, UINT64_MAX}, {UINT64_MAX, 0}};
    Bytes memory(256, std::byte{0x3C});
    for (const auto& [offset, size] : wrong) {
        require_refused(session,
                        concat("read of ", size, " bytes at ", offset, " from a buffer of 100"),
                        table.read(queue.get(), buffer.get(), offset, memory.data(), size));
        require_refused(session,
                        concat("write of ", size, " bytes at ", offset, " to a buffer of 100"),
                        table.write(queue.get(), buffer.get(), offset, memory.data(), size));
    }
    Bytes back(kSize);
    queue.read(buffer, back);
    queue.finish();
    require(back == kept, "a refused write changed the buffer");
    require(
        std::all_of(memory.begin(), memory.end(), [](std::byte b) { return b == std::byte{0x3C}; }),
        "a refused read wrote its destination");
}

void empty_ranges(CaseRun& run) {
    Queue queue(run.subject());
    const Buffer buffer(run.subject(), 10);
    const Bytes kept = pattern_bytes(10, 4);
    Bytes back(10);
    queue.write(buffer, kept);
    for (const uint64_t offset : {0, 5, 10}) {
        queue.write(buffer, {}, offset);
        queue.read(buffer, {}, offset);
    }
    queue.read(buffer, back);
    queue.finish();
    require(back == kept, "a write of 0 bytes changed the buffer");
}

void too_large(CaseRun& run) {
    const Session& session = run.subject();
    for (const uint64_t size : {uint64_t{1} << 60, UINT64_MAX - 100, UINT64_MAX}) {
        defrec_pbuffer* buffer = nullptr;
        require_refused(session, concat("buffer_create of ", size, " bytes"),
                        session.table().buffer_create(session.device(), size, &buffer));
        require(buffer == nullptr, "buffer_create refused, but wrote its output");
    }
    Queue queue(session);
    const Buffer after(session, 100);
    queue.write(after, pattern_bytes(100, 1));
    queue.finish();
}

}  // namespace

void add_abi_buffer_cases(std::vector<Case>& cases) {
    add_abi_case(cases, "buffer_zeroed", "A new buffer is zero, of memory used before too.",
                 zeroed);
    add_abi_case(cases, "buffer_round_trip", "Buffers of any size give back what was written.",
                 round_trip);
    add_abi_case(cases, "buffer_offsets", "Writes and reads touch their own bytes and no others.",
                 offsets);
    add_abi_case(cases, "write_reads_source",
                 "The source of a write may change when it has returned.", source_read_at_once);
    add_abi_case(cases, "queue_in_order", "Writes and reads of a queue happen in their order.",
                 in_order);
    add_abi_case(cases, "buffer_ranges",
                 "Ranges that do not lie in the buffer are refused, and nothing is touched.",
                 ranges);
    add_abi_case(cases, "buffer_empty_ranges", "Writes and reads of 0 bytes are nothing.",
                 empty_ranges);
    add_abi_case(cases, "buffer_too_large",
                 "A buffer larger than any memory is refused, and the device goes on.", too_large);
}

}  // namespace defrec::conformance
