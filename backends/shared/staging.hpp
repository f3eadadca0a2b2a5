// What a queue of a device keeps in the host's memory, whatever drives the device: staging buffers,
// each used again once the device is past a value, and reads that wait to be delivered. A queue's
// values count its submissions: 1, 2 ...
#pragma once
#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <deque>
#include <span>
#include <utility>
#include <vector>

#include "backends/shared/stage.hpp"

namespace defrec {

constexpr uint64_t kMinStaging = 4096;

// Buffer: memory that the host and the device see; has size(). kBytes: its member that tells where
// the host sees it. threads: one at a time.
template <class Buffer, std::byte* (Buffer::*kBytes)() const>
class Staging {
  public:
    struct Slot {
        Buffer buffer;
        uint64_t busy_until;
        std::byte* bytes() const { return (buffer.*kBytes)(); }
    };

    // The smallest free one that is large enough; a new one from make(size) where there is none,
    // which ends once a frame has been through. It is busy until the device, now at `reached`, has
    // reached `until`, and stays where it is.
    template <class Make>
    Slot& take(uint64_t size, uint64_t reached, uint64_t until, Make&& make) {
        Slot* best = nullptr;
        for (Slot& slot : slots_)
            if (slot.busy_until <= reached && slot.buffer.size() >= size &&
                (best == nullptr || slot.buffer.size() < best->buffer.size()))
                best = &slot;
        if (best == nullptr)
            best = &slots_.emplace_back(Slot{make(std::bit_ceil(std::max(size, kMinStaging))), 0});
        best->busy_until = until;
        return *best;
    }

    // What the slot holds at the value that it was just taken until goes to dst when that value is
    // delivered.
    void deliver_later(Slot& slot, void* dst, uint64_t size) {
        reads_.push_back({&slot, dst, size, slot.busy_until});
        // Until its bytes are delivered, not only until they are copied.
        slot.busy_until = UINT64_MAX;
    }
    // The reads up to a value, which is reached.
    void deliver(uint64_t value) {
        std::erase_if(reads_, [&](const PendingRead& read) {
            if (read.value > value) return false;
            std::memcpy(read.dst, read.slot->bytes(), read.size);
            read.slot->busy_until = 0;
            return true;
        });
    }
    // Reads into dst are not delivered; the device may still copy to where they wait.
    void forget(const void* dst) {
        std::erase_if(reads_, [&](const PendingRead& read) {
            if (read.dst != dst) return false;
            read.slot->busy_until = read.value;
            return true;
        });
    }
    // What has gathered since the submission of that value will not run. Its reads must not be
    // delivered: the next submission gets the value that they wait for.
    void drop_after(uint64_t submitted) noexcept {
        std::erase_if(reads_, [&](const PendingRead& read) {
            if (read.value <= submitted) return false;
            read.slot->busy_until = 0;
            return true;
        });
    }

  private:
    struct PendingRead {
        Slot* slot;
        void* dst;
        uint64_t size, value;
    };
    std::deque<Slot> slots_;  // grows without moving what reads_ points to
    std::vector<PendingRead> reads_;
};

// The bytes of a buffer after all work of a queue so far, at least one. Waits.
template <class Queue, class Buffer>
std::vector<std::byte> contents(Queue& queue, const Buffer& buffer) {
    std::vector<std::byte> bytes(std::max<uint64_t>(buffer.size(), 1));
    try {
        queue.read(buffer, 0, bytes.data(), buffer.size());
        queue.wait(queue.signal(), UINT64_MAX);
    } catch (...) {
        queue.forget_read(bytes.data());
        throw;
    }
    return bytes;
}

// The contents of buffers, nullptr: not given, as a stage's prepare takes them.
class HostCopies {
  public:
    template <class Queue, class Buffers>
    HostCopies(Queue& queue, const Buffers& buffers)
        : bytes_(buffers.size()), views_(buffers.size()) {
        for (size_t i = 0; i < buffers.size(); ++i) {
            if (buffers[i] == nullptr) continue;
            bytes_[i] = contents(queue, *buffers[i]);
            views_[i] = {bytes_[i].data(), buffers[i]->size()};
        }
    }
    std::span<const InBuffer> views() const { return views_; }

  private:
    std::vector<std::vector<std::byte>> bytes_;
    std::vector<InBuffer> views_;
};

}  // namespace defrec
