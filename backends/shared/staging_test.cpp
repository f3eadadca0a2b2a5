// Staging buffers, and a queue made of them whose device the test plays: it copies when it is told
// to.
#include "backends/shared/staging.hpp"

#include <doctest/doctest.h>

#include <array>
#include <functional>
#include <random>

using namespace defrec;

namespace {

class Memory {
  public:
    explicit Memory(uint64_t size) : bytes_(size) {}
    std::byte* data() const { return bytes_.data(); }
    uint64_t size() const { return bytes_.size(); }

  private:
    mutable std::vector<std::byte> bytes_;
};
using TestStaging = Staging<Memory, &Memory::data>;

Memory make(uint64_t size) { return Memory(size); }
Memory make_none(uint64_t) { throw StageError(DEFREC_ERROR_OUT_OF_MEMORY, "none is to be made"); }

// In order, as those of the backends.
class TestQueue {
  public:
    void write(const Memory& buffer, uint64_t offset, const void* src, uint64_t size) {
        TestStaging::Slot& slot = take(size);
        std::memcpy(slot.bytes(), src, size);
        gathered_.push_back(
            [&slot, to = buffer.data() + offset, size] { std::memcpy(to, slot.bytes(), size); });
    }
    void read(const Memory& buffer, uint64_t offset, void* dst, uint64_t size) {
        if (size == 0) return;
        TestStaging::Slot& slot = take(size);
        gathered_.push_back([&slot, from = buffer.data() + offset, size] {
            std::memcpy(slot.bytes(), from, size);
        });
        staging_.deliver_later(slot, dst, size);
    }
    uint64_t signal() {
        if (refuses) {
            gathered_.clear();
            staging_.drop_after(submitted_);
            throw StageError(DEFREC_ERROR_INTERNAL, "not submitted");
        }
        work_.push_back(std::exchange(gathered_, {}));
        return ++submitted_;
    }
    bool wait(uint64_t value, uint64_t) {
        run_until(value);
        staging_.deliver(value);
        return true;
    }
    void forget_read(const void* dst) { staging_.forget(dst); }

    // The device's side.
    void run_until(uint64_t value) {
        for (; reached_ < value; ++reached_)
            for (const auto& copy : work_[reached_]) copy();
    }
    uint64_t submitted() const { return submitted_; }

    bool refuses = false;
    size_t made = 0;

  private:
    TestStaging::Slot& take(uint64_t size) {
        return staging_.take(size, reached_, submitted_ + 1, [this](uint64_t at_least) {
            ++made;
            return Memory(at_least);
        });
    }
    TestStaging staging_;
    uint64_t submitted_ = 0, reached_ = 0;
    std::vector<std::function<void()>> gathered_;
    std::vector<std::vector<std::function<void()>>> work_;
};

std::array<uint32_t, 4> words(uint32_t value) { return {value, value + 1, value + 2, value + 3}; }

}  // namespace

TEST_CASE(
    "the smallest free buffer that is large enough is taken; new ones are powers of two, none very "
    "small") {
    TestStaging staging;
    auto& minimum = staging.take(1, 0, 1, make);
    CHECK(minimum.buffer.size() == kMinStaging);
    auto& large = staging.take(100000, 0, 1, make);
    CHECK(large.buffer.size() == 131072);
    auto& middle = staging.take(kMinStaging + 1, 0, 1, make);
    CHECK(middle.buffer.size() == 2 * kMinStaging);
    CHECK(&staging.take(kMinStaging + 1, 1, 2, make_none) == &middle);
    CHECK(&staging.take(kMinStaging, 1, 2, make_none) == &minimum);
    CHECK(&staging.take(8, 1, 2, make_none) == &large);
    CHECK_THROWS_AS(staging.take(8, 1, 2, make_none), StageError);
}

TEST_CASE("a buffer is used again when the device has reached the value, not before") {
    TestStaging staging;
    auto& first = staging.take(8, 0, 3, make);
    CHECK(&staging.take(8, 2, 4, make) != &first);
    CHECK(&staging.take(8, 3, 4, make_none) == &first);
}

TEST_CASE("a buffer that cannot be made changes nothing") {
    TestStaging staging;
    auto& only = staging.take(8, 0, 1, make);
    CHECK_THROWS_AS(staging.take(2 * kMinStaging, 1, 2, make_none), StageError);
    CHECK(&staging.take(8, 1, 2, make_none) == &only);
}

TEST_CASE(
    "a read keeps its buffer until it is delivered, however far the device is, and many more are "
    "taken") {
    TestStaging staging;
    uint32_t out = 0;
    const uint32_t value = 42;
    auto& slot = staging.take(4, 0, 2, make);
    std::memcpy(slot.bytes(), &value, 4);
    staging.deliver_later(slot, &out, 4);
    for (int i = 0; i < 100; ++i) CHECK(&staging.take(4, 5, 6, make) != &slot);
    staging.deliver(1);
    CHECK(out == 0);
    staging.deliver(2);
    CHECK(out == 42);
    CHECK(&staging.take(4, 5, 6, make_none) == &slot);
    // Once.
    out = 0;
    staging.deliver(9);
    CHECK(out == 0);
}

TEST_CASE(
    "a read that is forgotten is not delivered, and its buffer is the device's until it is past "
    "it") {
    TestStaging staging;
    uint32_t out = 7, other = 7;
    auto& slot = staging.take(4, 0, 2, make);
    staging.deliver_later(slot, &out, 4);
    auto& kept = staging.take(4, 0, 2, make);
    staging.deliver_later(kept, &other, 4);
    staging.forget(&out);
    CHECK_THROWS_AS(staging.take(4, 1, 3, make_none), StageError);
    staging.deliver(2);
    CHECK(out == 7);
    CHECK(other == 0);
    // The one that was delivered is free, and the one that was forgotten.
    staging.take(4, 2, 3, make_none);
    staging.take(4, 2, 3, make_none);
}

TEST_CASE("reads after a value are dropped and leave their buffers; those before are delivered") {
    TestStaging staging;
    uint32_t before = 7, after = 7;
    auto& submitted = staging.take(4, 0, 1, make);
    staging.deliver_later(submitted, &before, 4);
    auto& gathered = staging.take(4, 0, 2, make);
    staging.deliver_later(gathered, &after, 4);
    staging.drop_after(1);
    CHECK(&staging.take(4, 0, 2, make_none) == &gathered);
    staging.deliver(2);  // what was submitted in its place
    CHECK(before == 0);
    CHECK(after == 7);
}

TEST_CASE("contents come after all work before, also of a buffer of no bytes") {
    TestQueue queue;
    const Memory buffer(16), empty(0);
    const auto values = words(1);
    queue.write(buffer, 0, values.data(), 16);
    const std::vector<std::byte> bytes = contents(queue, buffer);
    REQUIRE(bytes.size() == 16);
    CHECK(std::memcmp(bytes.data(), values.data(), 16) == 0);
    CHECK(contents(queue, empty).size() == 1);

    const std::array<const Memory*, 3> buffers{&buffer, nullptr, &empty};
    const HostCopies copies(queue, buffers);
    REQUIRE(copies.views().size() == 3);
    CHECK(copies.views()[0].size == 16);
    CHECK(std::memcmp(copies.views()[0].data, values.data(), 16) == 0);
    CHECK(copies.views()[1].data == nullptr);
    CHECK(copies.views()[1].size == 0);
    CHECK(copies.views()[2].data != nullptr);
    CHECK(copies.views()[2].size == 0);
}

// Memory that contents would have filled is gone by the time of the next submission.
TEST_CASE("contents that cannot be had are forgotten") {
    struct Stopping : TestQueue {
        bool wait(uint64_t, uint64_t) { throw StageError(DEFREC_ERROR_DEVICE_LOST, "lost"); }
        void forget_read(const void* dst) {
            ++forgotten;
            TestQueue::forget_read(dst);
        }
        int forgotten = 0;
    } queue;
    const Memory buffer(16);
    CHECK_THROWS_AS(contents(queue, buffer), StageError);
    CHECK(queue.forgotten == 1);
    queue.TestQueue::wait(queue.submitted(), UINT64_MAX);  // would write to freed memory
    queue.refuses = true;
    CHECK_THROWS_AS(contents(queue, buffer), StageError);
    CHECK(queue.forgotten == 2);
}

namespace {

// A read that the test waits for.
struct Read {
    std::array<uint32_t, 4> out, expected;
    uint64_t value;
    bool lost = false;

    // The value to be expected when the signal has reached `reached`.
    std::array<uint32_t, 4> wanted(uint64_t reached) const {
        return value <= reached && !lost ? expected : std::array<uint32_t, 4>{};
    }
};

}  // namespace

TEST_CASE(
    "whenever the device copies and whichever submissions fail, a read brings what was last "
    "written, or nothing") {
    std::mt19937 random(1);
    const auto below = [&](uint32_t limit) { return static_cast<uint32_t>(random() % limit); };
    constexpr uint32_t kPlaces = 8;
    TestQueue queue;
    const Memory buffer(16 * kPlaces);
    std::array<std::array<uint32_t, 4>, kPlaces> submitted{}, gathered{};
    std::deque<Read> reads;
    uint32_t next = 1, delivered = 0, lost = 0;
    for (int step = 0; step < 20000; ++step) {
        const uint32_t place = below(kPlaces);
        switch (below(8)) {
            case 0:
            case 1:
                gathered[place] = words(next += 4);
                queue.write(buffer, 16 * place, gathered[place].data(), 16);
                break;
            case 2:
            case 3:
                reads.push_back({{}, gathered[place], queue.submitted() + 1});
                queue.read(buffer, 16 * place, reads.back().out.data(), 16);
                break;
            case 4:
            case 5:
                queue.refuses = below(4) == 0;
                try {
                    queue.signal();
                    submitted = gathered;
                } catch (const StageError&) {
                    gathered = submitted;
                    for (Read& read : reads)
                        if (read.value > queue.submitted()) read.lost = true;
                }
                break;
            case 6:
                queue.run_until(queue.submitted() -
                                below(std::min<uint32_t>(3, uint32_t(queue.submitted()) + 1)));
                break;
            default: {
                const uint64_t value = queue.submitted() - below(std::min<uint32_t>(
                                                               3, uint32_t(queue.submitted()) + 1));
                queue.wait(value, UINT64_MAX);
                for (const Read& read : reads) REQUIRE(read.out == read.wanted(value));
                for (; !reads.empty() && reads.front().value <= value; reads.pop_front())
                    ++(reads.front().lost ? lost : delivered);
            }
        }
    }
    CHECK(delivered > 1000);
    CHECK(lost > 100);
    CHECK(queue.made < 200);
}
