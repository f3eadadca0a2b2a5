// See block.hpp. A block's threads are fibers of one OS thread, resumed in turn; one that waits
// gives way until all it waits for have come. The blocks of a cooperative grid or a cluster have an
// OS thread each; those of others are shared out among as many as there are processors.
#include "backends/cuda/emulation/block.hpp"

#include <array>
#include <atomic>
#include <barrier>
#include <boost/context/fiber.hpp>
#include <boost/context/pooled_fixedsize_stack.hpp>
#include <exception>
#include <optional>
#include <stdexcept>
#include <thread>

namespace defrec::cuda::emulation {
namespace {

namespace context = boost::context;
constexpr size_t kStackBytes = 64 * 1024;
constexpr uint32_t kMaxThreads = 1024;

uint64_t count(const dim3& size) { return uint64_t{size.x} * size.y * size.z; }
dim3 place_in(const dim3& size, uint64_t index) {
    return {static_cast<uint32_t>(index % size.x), static_cast<uint32_t>(index / size.x % size.y),
            static_cast<uint32_t>(index / size.x / size.y)};
}

struct WholeGrid {
    explicit WholeGrid(uint64_t blocks) : barrier(static_cast<std::ptrdiff_t>(blocks)) {}
    std::barrier<> barrier;
};

// Lanes of one warp that exchange values. There are two results, used in turn: before a lane can
// ask for the next but one, all have read this one.
struct Exchange {
    uint32_t arrived = 0;
    uint32_t turn = 0;
    uint64_t values[32], results[2][32];
};

class Block {
  public:
    explicit Block(const KernelCall& call)
        : call_(call),
          threads_(count(call.grid.threads)),
          warps_((threads_ + 31) / 32),
          dynamic_(call.grid.shared / 16 + 1),
          stacks_(kStackBytes) {
        if (threads_ == 0 || threads_ > kMaxThreads)
            throw std::logic_error("emulation: a block has 1 to 1024 threads");
        lanes_.resize(threads_);
    }

    void run(uint64_t index, WholeGrid* grid);

    const ThreadPlace& place() const { return lanes_[current_].place; }
    std::byte* dynamic() { return reinterpret_cast<std::byte*>(dynamic_.data()); }
    uint32_t lane() const { return current_ % 32; }
    int sync(bool predicate);
    void sync_grid();
    const uint64_t* exchange(uint32_t mask, uint64_t value);

  private:
    struct Lane {
        context::fiber fiber;
        ThreadPlace place;
        bool waits = false, done = false;
    };
    struct alignas(16) Chunk {
        std::byte bytes[16];
    };
    void give_way() { scheduler_ = std::move(scheduler_).resume(); }
    void release_block();
    void finish_lane();

    const KernelCall& call_;
    size_t threads_;
    std::vector<std::array<Exchange, 32>> warps_;  // by the mask's first lane
    std::vector<Chunk> dynamic_;
    context::pooled_fixedsize_stack stacks_;
    std::vector<Lane> lanes_;
    context::fiber scheduler_;
    uint32_t current_ = 0;
    size_t arrived_ = 0, alive_ = 0;
    uint64_t progress_ = 0;  // counts arrivals and ends
    int counted_ = 0, count_ = 0;
    bool at_grid_barrier_ = false;
};

thread_local Block* running = nullptr;

void Block::release_block() {
    arrived_ = 0;
    count_ = std::exchange(counted_, 0);
    for (Lane& lane : lanes_) lane.waits = false;
}

int Block::sync(bool predicate) {
    ++progress_;
    counted_ += predicate;
    if (++arrived_ == alive_) {
        release_block();
    } else {
        lanes_[current_].waits = true;
        while (lanes_[current_].waits) give_way();
    }
    return count_;
}

void Block::sync_grid() {
    ++progress_;
    at_grid_barrier_ = ++arrived_ == alive_;
    lanes_[current_].waits = true;
    while (lanes_[current_].waits) give_way();
}

const uint64_t* Block::exchange(uint32_t mask, uint64_t value) {
    const uint32_t lane = current_ % 32;
    ++progress_;
    Exchange& group = warps_[current_ / 32][static_cast<size_t>(std::countr_zero(mask))];
    const uint32_t turn = group.turn;
    group.values[lane] = value;
    group.arrived |= 1u << lane;
    if (group.arrived == mask) {
        std::copy(std::begin(group.values), std::end(group.values), group.results[turn % 2]);
        group.arrived = 0;
        ++group.turn;
    } else {
        while (group.turn == turn) give_way();
    }
    return group.results[turn % 2];
}

void Block::finish_lane() {
    ++progress_;
    lanes_[current_].done = true;
    --alive_;
    if (alive_ > 0 && arrived_ == alive_) release_block();
}

void Block::run(uint64_t index, WholeGrid* grid) {
    running = this;
    alive_ = threads_;
    arrived_ = 0;
    for (auto& groups : warps_)
        for (Exchange& group : groups) group.arrived = 0;
    for (size_t i = 0; i < threads_; ++i) {
        Lane& lane = lanes_[i];
        lane.waits = lane.done = false;
        lane.place = {place_in(call_.grid.threads, i), place_in(call_.grid.blocks, index),
                      call_.grid.threads, call_.grid.blocks};
        lane.fiber = context::fiber(std::allocator_arg, stacks_, [this](context::fiber&& back) {
            scheduler_ = std::move(back);
            call_.body();
            finish_lane();
            return std::move(scheduler_);
        });
    }
    while (alive_ > 0) {
        const uint64_t before = progress_;
        for (current_ = 0; current_ < threads_; ++current_) {
            Lane& lane = lanes_[current_];
            if (!lane.done && !lane.waits) lane.fiber = std::move(lane.fiber).resume();
        }
        if (at_grid_barrier_) {
            at_grid_barrier_ = false;
            if (grid == nullptr)
                throw std::logic_error("emulation: GridBarrier in a grid that is not cooperative");
            grid->barrier.arrive_and_wait();
            release_block();
        } else if (progress_ == before) {
            throw std::logic_error("emulation: threads wait for others that do not come");
        }
    }
}

}  // namespace

const ThreadPlace& place() { return running->place(); }
std::byte* dynamic_shared_memory() { return running->dynamic(); }
int sync_block(bool predicate) { return running->sync(predicate); }
void sync_whole_grid() { running->sync_grid(); }
const uint64_t* exchange(uint32_t mask, uint64_t value) { return running->exchange(mask, value); }
uint32_t lane() { return running->lane(); }

void run(const KernelCall& call) {
    const uint64_t blocks = count(call.grid.blocks);
    const bool at_once = call.grid.cooperative || call.grid.cluster;
    const uint64_t workers =
        at_once ? blocks : std::min<uint64_t>(blocks, std::thread::hardware_concurrency());
    std::optional<WholeGrid> grid;
    if (at_once) grid.emplace(blocks);
    std::atomic<uint64_t> next{0};
    std::vector<std::exception_ptr> failures(workers);
    const auto work = [&](uint64_t worker) {
        try {
            Block block(call);
            for (uint64_t i; (i = next.fetch_add(1)) < blocks;)
                block.run(i, grid ? &*grid : nullptr);
        } catch (...) {
            failures[worker] = std::current_exception();
        }
    };
    if (workers == 1) {
        work(0);
    } else {
        std::vector<std::thread> threads;
        for (uint64_t worker = 0; worker < workers; ++worker) threads.emplace_back(work, worker);
        for (std::thread& thread : threads) thread.join();
    }
    for (const std::exception_ptr& failure : failures)
        if (failure != nullptr) std::rethrow_exception(failure);
}

}  // namespace defrec::cuda::emulation
