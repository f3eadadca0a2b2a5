// Operations wait for what they must, and for nothing else.
#include "backends/cuda/operations.hpp"

#include <doctest/doctest.h>

using namespace defrec::cuda;

namespace {

std::byte memory[1000];

MemoryRange part(uint64_t first, uint64_t size) { return {memory + first, size}; }

Operation run(uint64_t stage, std::vector<MemoryRange> reads, std::vector<MemoryRange> writes) {
    return std::make_shared<const StageRun>(
        StageRun{1, stage, {}, std::move(reads), std::move(writes)});
}

using Waits = std::vector<std::vector<size_t>>;

}  // namespace

TEST_CASE("a frame's beginning: both views, then stereo beside features") {
    const std::vector<Operation> frame{
        Upload{memory, memory + 900, 10},                         // 0 left
        Upload{memory + 10, memory + 910, 10},                    // 1 right
        run(0, {part(0, 10)}, {part(100, 10)}),                   // 2 rectify left
        run(0, {part(10, 10)}, {part(110, 10)}),                  // 3 rectify right
        run(5, {part(100, 10), part(110, 10)}, {part(200, 10)}),  // 4 stereo
        run(6, {part(100, 10)}, {part(300, 10)}),                 // 5 orb
        Download{memory + 950, memory + 300, 10},                 // 6 features
        run(7, {part(300, 10), part(200, 10)}, {part(400, 10)}),  // 7 match
    };
    CHECK(dependencies(frame) == Waits{{}, {}, {0}, {1}, {3, 2}, {2}, {5}, {5, 4}});
}

TEST_CASE("what is waited for by way of another is not named again") {
    const std::vector<Operation> chain{run(1, {}, {part(0, 10)}),
                                       run(2, {part(0, 10)}, {part(10, 10)}),
                                       run(3, {part(0, 10), part(10, 10)}, {part(20, 10)})};
    CHECK(dependencies(chain) == Waits{{}, {0}, {1}});
}

TEST_CASE("memory is not overwritten before it was read, nor written in another order") {
    const std::vector<Operation> operations{
        run(1, {part(0, 10)}, {part(50, 10)}), Upload{memory + 5, memory + 900, 10},
        Upload{memory + 14, memory + 920, 1}, Download{memory + 930, memory + 14, 1},
        Upload{memory + 15, memory + 920, 5}};
    CHECK(dependencies(operations) == Waits{{}, {0}, {1}, {2}, {}});
}

TEST_CASE(
    "the host's memory is like the device's: it is read after it was written, and not overwritten "
    "before it was read") {
    const std::vector<Operation> there_and_back{
        Download{memory + 900, memory, 10}, Upload{memory + 100, memory + 905, 10},
        Download{memory + 910, memory + 200, 10}, Upload{memory + 300, memory + 914, 1}};
    CHECK(dependencies(there_and_back) == Waits{{}, {0}, {1}, {2}});
}

TEST_CASE("runs of one stage follow each other, those of a reentrant one need not") {
    const std::vector<Operation> same{run(3, {part(0, 1)}, {part(1, 1)}),
                                      run(3, {part(2, 1)}, {part(3, 1)})};
    CHECK(dependencies(same) == Waits{{}, {0}});
    const std::vector<Operation> reentrant{run(0, {part(0, 1)}, {part(1, 1)}),
                                           run(0, {part(2, 1)}, {part(3, 1)})};
    CHECK(dependencies(reentrant) == Waits{{}, {}});
}

TEST_CASE("reading together, and buffers not given, keep nobody waiting") {
    const std::vector<Operation> readers{
        run(1, {part(0, 10), {nullptr, 0}}, {part(20, 1), {nullptr, 0}}),
        run(2, {part(0, 10), {nullptr, 0}}, {part(21, 1), {nullptr, 0}})};
    CHECK(dependencies(readers) == Waits{{}, {}});
}

TEST_CASE("what is recorded early waits for what it reads, and what follows for all") {
    auto early =
        std::make_shared<StageRun>(StageRun{1, 4, {}, {part(0, 10), part(10, 10)}, {part(40, 10)}});
    Recorder recorder(early->recording);
    recorder.early({part(0, 10)}, [&] {
        recorder.fill(memory + 800, 0, 1);
        recorder.fill(memory + 810, 0, 1);
    });
    recorder.fill(memory + 40, 0, 1);
    recorder.fill(memory + 41, 0, 1);
    const std::vector<Node>& nodes = early->recording.nodes;
    REQUIRE(nodes.size() == 4);
    CHECK(nodes[0].first);
    CHECK(nodes[1].first);
    CHECK(nodes[1].after == std::vector<uint32_t>{0});
    CHECK(nodes[2].first);
    CHECK(nodes[2].early.empty());
    CHECK(nodes[2].after == std::vector<uint32_t>{1});
    CHECK_FALSE(nodes[3].first);

    const std::vector<Operation> operations{run(1, {}, {part(0, 10)}), run(2, {}, {part(10, 10)}),
                                            run(4, {}, {part(30, 10)}),  // the same stage
                                            run(3, {part(10, 10)}, {part(20, 10)}), early};
    CHECK(dependencies(operations).back() == std::vector<size_t>{2, 1, 0});
    CHECK(early_dependencies(operations, 4, nodes[0]) == std::vector<size_t>{0, 2});
}
