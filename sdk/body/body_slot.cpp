// See body_slot.hpp.
#include "sdk/body/body_slot.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <new>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "sdk/base/os/services.hpp"
#include "sdk/base/util/error.hpp"
#include "sdk/base/util/wait_end.hpp"
#include "sdk/body/decisions.hpp"

namespace defrec {
namespace {

// One more in the count while it lives.
class Counted {
  public:
    explicit Counted(std::atomic<int>& count) : count_(count) { ++count_; }
    ~Counted() { --count_; }
    Counted(const Counted&) = delete;
    Counted& operator=(const Counted&) = delete;

  private:
    std::atomic<int>& count_;
};

}  // namespace

// Outlives the slot while it runs.
struct BodySlot::Task {
    Task(const BodySurface& surface, std::shared_ptr<const BodyDescription> given)
        : vertices(surface.vertices.begin(), surface.vertices.end()),
          piece(surface.piece.begin(), surface.piece.end()),
          pieces(surface.pieces),
          cuts(surface.cuts.begin(), surface.cuts.end()),
          description(std::move(given)) {}

    // By the background thread.
    void run(const std::weak_ptr<const Services>& services) noexcept {
        if (has_begun.exchange(true)) return;
        const auto goes_on = [&] { return is_wanted && !is_done && !services.expired(); };
        auto last = std::chrono::steady_clock::now();
        const auto paced = [&] {
            rest(last, goes_on);
            return goes_on();
        };
        compute({vertices, piece, pieces, cuts}, std::cref(paced));  // which needs no memory
        publish({});  // that it was dropped, unless there is more to say
        vertices = {};
        piece = {};
        cuts = {};
    }
    // surface: what it was made for. goes_on: asked now and then; where it says false nothing comes
    // of it.
    void compute(const BodySurface& surface, const std::function<bool()>& goes_on) noexcept {
        Outcome made;
        try {
            static const BodyDescription kNothingKnown;
            if (!goes_on()) return;
            made.body =
                Body::make(surface, description != nullptr ? *description : kNothingKnown, goes_on);
        } catch (const Error& error) {
            made.status = error.status();
            made.tell("no body can be made of this surface: ", error.what());
        } catch (const std::exception&) {
            made.status = DEFREC_ERROR_OUT_OF_MEMORY;
            made.tell("out of memory", "");
        }
        if (made.body != nullptr || made.status != DEFREC_OK) publish(std::move(made));
    }
    // Unless it has begun. A frame waits for nothing here.
    void drop() noexcept {
        if (!has_begun) is_wanted = false;
    }

    struct Outcome {
        std::shared_ptr<const Body> body;
        defrec_status status = DEFREC_OK;
        std::string reason;

        void tell(const char* text, const char* more) noexcept {
            try {
                reason = std::string(text) + more;
            } catch (const std::bad_alloc&) {
                reason = "out of memory";  // short enough to need none
            }
        }
    };
    const std::shared_ptr<const Body>& body() const { return outcome.body; }
    // Done, and there is no body to wait for.
    bool has_failed() const { return is_done && outcome.status != DEFREC_OK; }
    bool was_dropped() const {
        return !is_wanted || (is_done && body() == nullptr && !has_failed());
    }

    std::atomic<bool> is_wanted{true}, has_begun{false};
    std::atomic<int> waiting{0};  // threads
    std::mutex mutex;             // to wait
    std::condition_variable changed;
    // From then on the outcome stays, so that it is read without the mutex.
    std::atomic<bool> is_done{false};
    Outcome outcome;

  private:
    // So that frames meanwhile take hardly longer: two fifths of the time are worked, unless
    // somebody waits. last: until when it rested before.
    template <class GoesOn>
    void rest(std::chrono::steady_clock::time_point& last, const GoesOn& goes_on) const {
        using Clock = std::chrono::steady_clock;
        constexpr std::chrono::milliseconds kSlice{5};
        const Clock::time_point now = Clock::now(),
                                end = now + std::chrono::duration_cast<Clock::duration>(
                                                decisions::BodyWork::kRest * (now - last));
        while (waiting == 0 && goes_on() && Clock::now() < end)
            std::this_thread::sleep_for(std::min<Clock::duration>(kSlice, end - Clock::now()));
        last = Clock::now();
    }
    // The first one counts.
    void publish(Outcome made) noexcept {
        const std::lock_guard lock(mutex);
        if (is_done) return;
        outcome = std::move(made);
        is_done = true;
        changed.notify_all();
    }

    std::vector<defrec_surface_point> vertices;
    std::vector<uint8_t> piece;
    const size_t pieces;
    std::vector<defrec_cut_point> cuts;
    const std::shared_ptr<const BodyDescription> description;
};

struct BodySlot::Lineage {
    std::mutex mutex;  // of the description
    std::shared_ptr<const BodyDescription> description;
    std::atomic<uint64_t> generation{0};

    uint64_t describe(std::shared_ptr<const BodyDescription> now) {
        const std::lock_guard lock(mutex);
        description = std::move(now);
        return ++generation;
    }
    std::pair<std::shared_ptr<const BodyDescription>, uint64_t> last() {
        const std::lock_guard lock(mutex);
        return {description, generation};
    }
};

BodySlot::BodySlot(std::weak_ptr<const Services> services)
    : services_(std::move(services)), lineage_(std::make_shared<Lineage>()), generation_(0) {}

BodySlot::BodySlot(std::shared_ptr<const BodySlot> before)
    : services_(before->services_),
      lineage_(before->lineage_),
      generation_(before->generation_.load()),
      before_(std::move(before)),
      description_(before_->description()) {}

BodySlot::~BodySlot() {
    if (task_ != nullptr) task_->is_wanted = false;
}

std::shared_ptr<BodySlot::Task> BodySlot::queue(
    const BodySurface& surface, std::shared_ptr<const BodyDescription> description) const {
    auto task = std::make_shared<Task>(surface, std::move(description));
    // One that nobody wants any more takes no memory while it waits for its turn.
    if (const std::shared_ptr<const Services> services = services_.lock())
        services->background().add([waiting = std::weak_ptr(task), weak = services_] {
            if (const std::shared_ptr<Task> its_turn = waiting.lock()) its_turn->run(weak);
        });
    return task;
}

// Under the mutex.
std::shared_ptr<BodySlot::Task> BodySlot::begin(const BodySurface& surface) {
    if (task_ == nullptr) task_ = queue(surface, description_);
    return task_;
}

void BodySlot::start(const BodySurface& surface) noexcept {
    try {
        const std::lock_guard lock(mutex_);
        begin(surface);
        // A surface that grows faster than bodies are computed goes without some of them.
        while (before_ != nullptr && before_->drop()) before_ = before_->before();
    } catch (const std::exception&) {
        // Without a body deep points move as before there is one.
    }
}

// true: its own body will never serve.
bool BodySlot::drop() const {
    const std::lock_guard lock(mutex_);
    if (task_ == nullptr) return last_ == nullptr;
    task_->drop();
    return task_->was_dropped() && last_ == nullptr;
}

std::shared_ptr<const BodySlot> BodySlot::before() const {
    const std::lock_guard lock(mutex_);
    return before_;
}

// Under the mutex: what served until there was a body, or none can be made.
void BodySlot::release_old() const {
    if (task_ == nullptr || !task_->is_done || (task_->body() == nullptr && !task_->has_failed()))
        return;
    before_.reset();
    last_.reset();
}

defrec_status BodySlot::wait(const BodySurface& surface, uint64_t timeout_ns) {
    // The background thread has a low priority: who has waited that long computes as well.
    constexpr std::chrono::milliseconds kPatience{1500}, kLook{20};  // whether services are gone
    using Clock = std::chrono::steady_clock;
    const Clock::time_point start = Clock::now(), end = wait_end(timeout_ns);
    for (;;) {
        std::shared_ptr<Task> task;
        {
            const std::lock_guard lock(mutex_);
            task = begin(surface);
        }
        const Counted waiting(task->waiting);
        if (!task->is_done && Clock::now() < end &&
            (services_.expired() || Clock::now() - start > kPatience))
            task->compute(surface, [&] { return !task->is_done && Clock::now() < end; });
        {
            std::unique_lock lock(task->mutex);
            task->changed.wait_until(lock, std::min(end, Clock::now() + kLook),
                                     [&] { return task->is_done.load(); });
        }
        if (!task->is_done) {
            if (Clock::now() >= end) return DEFREC_TIMEOUT;
            continue;
        }
        if (task->body() != nullptr) return DEFREC_OK;
        // Who waits next begins again where it was dropped or memory ran out.
        if (!task->has_failed() || task->outcome.status == DEFREC_ERROR_OUT_OF_MEMORY) {
            const std::lock_guard own(mutex_);
            release_old();
            if (task_ == task) task_.reset();
        }
        if (task->has_failed()) fail(task->outcome.status, task->outcome.reason);
    }
}

void BodySlot::replace(std::shared_ptr<Task> task,
                       std::shared_ptr<const BodyDescription> description, uint64_t generation) {
    std::shared_ptr<const Body> usable = body();
    const std::lock_guard lock(mutex_);
    last_ = std::move(usable);
    if (task_ != nullptr) task_->is_wanted = false;
    task_ = std::move(task);
    description_ = std::move(description);
    generation_ = generation;
}

void BodySlot::describe(std::shared_ptr<const BodyDescription> description,
                        const BodySurface& surface) {
    std::shared_ptr<Task> task = queue(surface, description);
    const uint64_t generation = lineage_->describe(description);
    replace(std::move(task), std::move(description), generation);
}

void BodySlot::follow_lineage(const BodySurface& surface) noexcept {
    if (generation_ == lineage_->generation) return;
    try {
        auto [description, generation] = lineage_->last();
        std::shared_ptr<Task> task = queue(surface, description);
        replace(std::move(task), std::move(description), generation);
    } catch (const std::exception&) {
        // The next call tries again.
    }
}

void BodySlot::recall(std::shared_ptr<const BodyDescription> description) {
    const std::lock_guard lock(mutex_);
    generation_ = lineage_->describe(description);
    description_ = std::move(description);
}

std::shared_ptr<const Body> BodySlot::body() const {
    std::shared_ptr<const BodySlot> before;
    {
        const std::lock_guard lock(mutex_);
        release_old();
        if (task_ != nullptr && task_->is_done && task_->body() != nullptr) return task_->body();
        if (last_ != nullptr) return last_;
        before = before_;
    }
    return before != nullptr ? before->body() : nullptr;
}

uint32_t BodySlot::state() const {
    const std::lock_guard lock(mutex_);
    release_old();
    if (task_ == nullptr) return DEFREC_BODY_STATE_NONE;
    if (!task_->is_done) return DEFREC_BODY_STATE_PENDING;
    return task_->body() != nullptr ? DEFREC_BODY_STATE_READY : DEFREC_BODY_STATE_NONE;
}

std::shared_ptr<const BodyDescription> BodySlot::description() const {
    const std::lock_guard lock(mutex_);
    return description_;
}

}  // namespace defrec
