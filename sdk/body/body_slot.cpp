// See body_slot.hpp.
#include "sdk/body/body_slot.hpp"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <new>
#include <string>
#include <utility>
#include <vector>

#include "sdk/base/error.hpp"
#include "sdk/base/services.hpp"
#include "sdk/base/wait_end.hpp"

namespace defrec {

// Outlives the slot while it runs.
struct BodySlot::Task {
    Task(const BodySurface& surface, std::shared_ptr<const BodyDescription> given)
        : vertices(surface.vertices.begin(), surface.vertices.end()),
          piece(surface.piece.begin(), surface.piece.end()),
          pieces(surface.pieces),
          cuts(surface.cuts.begin(), surface.cuts.end()),
          description(std::move(given)) {}

    void run() noexcept {
        if (has_begun.exchange(true)) return;
        if (is_wanted) make();
        release(vertices, piece, cuts);
        const std::lock_guard lock(mutex);
        is_done = true;
        changed.notify_all();
    }
    // Unless it has begun. A frame waits for nothing here.
    void drop() noexcept {
        if (!has_begun) is_wanted = false;
    }
    // Done, and there is no body to wait for.
    bool has_failed() const { return is_done && body == nullptr && status != DEFREC_OK; }
    bool was_dropped() const { return !is_wanted || (is_done && body == nullptr && !has_failed()); }

    std::atomic<bool> is_wanted{true}, has_begun{false};
    std::mutex mutex;  // to wait
    std::condition_variable changed;
    // From then on what follows stays, so that it is read without the mutex.
    std::atomic<bool> is_done{false};
    std::shared_ptr<const Body> body;
    defrec_status status = DEFREC_OK;
    std::string reason;

  private:
    void make() noexcept {
        try {
            static const BodyDescription kNothingKnown;
            body = Body::make({vertices, piece, pieces, cuts},
                              description != nullptr ? *description : kNothingKnown,
                              [this] { return is_wanted.load(); });
        } catch (const Error& error) {
            status = error.status();
            tell("no body can be made of this surface: ", error.what());
        } catch (const std::exception&) {
            status = DEFREC_ERROR_OUT_OF_MEMORY;
            tell("out of memory", "");
        }
    }
    void tell(const char* text, const char* more) noexcept {
        try {
            reason = std::string(text) + more;
        } catch (const std::bad_alloc&) {
            reason = "out of memory";  // short enough to need none
        }
    }
    template <class... Vectors>
    static void release(Vectors&... vectors) {
        ((vectors = Vectors()), ...);
    }

    std::vector<defrec_surface_point> vertices;
    std::vector<uint8_t> piece;
    const size_t pieces;
    std::vector<defrec_cut_point> cuts;
    const std::shared_ptr<const BodyDescription> description;
};

BodySlot::BodySlot(std::weak_ptr<const Services> services) : services_(std::move(services)) {}

BodySlot::BodySlot(std::shared_ptr<const BodySlot> before)
    : services_(before->services_),
      before_(std::move(before)),
      description_(before_->description()) {}

BodySlot::~BodySlot() {
    if (task_ != nullptr) task_->is_wanted = false;
}

std::shared_ptr<BodySlot::Task> BodySlot::queue(
    const BodySurface& surface, std::shared_ptr<const BodyDescription> description) const {
    auto task = std::make_shared<Task>(surface, std::move(description));
    if (const std::shared_ptr<const Services> services = services_.lock())
        services->background().add([task] { task->run(); });
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
    if (task_ == nullptr || !task_->is_done || (task_->body == nullptr && !task_->has_failed()))
        return;
    before_.reset();
    last_.reset();
}

defrec_status BodySlot::wait(const BodySurface& surface, uint64_t timeout_ns) {
    constexpr std::chrono::milliseconds kLook{20};  // whether the services are gone
    using Clock = std::chrono::steady_clock;
    const Clock::time_point end = wait_end(timeout_ns);
    for (;;) {
        std::shared_ptr<Task> task;
        {
            const std::lock_guard lock(mutex_);
            task = begin(surface);
        }
        if (services_.expired()) task->run();
        std::unique_lock lock(task->mutex);
        const Clock::time_point until = std::min(end, Clock::now() + kLook);
        if (task->changed.wait_until(lock, until, [&] { return task->is_done.load(); })) {
            if (task->body != nullptr) return DEFREC_OK;
            lock.unlock();
            // Who waits next begins again where it was dropped or memory ran out.
            if (!task->has_failed() || task->status == DEFREC_ERROR_OUT_OF_MEMORY) {
                const std::lock_guard own(mutex_);
                release_old();
                if (task_ == task) task_.reset();
            }
            if (task->has_failed()) fail(task->status, task->reason);
        } else if (Clock::now() >= end) {
            return DEFREC_TIMEOUT;
        }
    }
}

void BodySlot::describe(std::shared_ptr<const BodyDescription> description,
                        const BodySurface& surface) {
    std::shared_ptr<const Body> usable = body();
    std::shared_ptr<Task> task = queue(surface, description);
    const std::lock_guard lock(mutex_);
    last_ = std::move(usable);
    if (task_ != nullptr) task_->is_wanted = false;
    task_ = std::move(task);
    description_ = std::move(description);
}

void BodySlot::recall(std::shared_ptr<const BodyDescription> description) {
    const std::lock_guard lock(mutex_);
    description_ = std::move(description);
}

std::shared_ptr<const Body> BodySlot::body() const {
    std::shared_ptr<const BodySlot> before;
    {
        const std::lock_guard lock(mutex_);
        release_old();
        if (task_ != nullptr && task_->is_done && task_->body != nullptr) return task_->body;
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
    return task_->body != nullptr ? DEFREC_BODY_STATE_READY : DEFREC_BODY_STATE_NONE;
}

std::shared_ptr<const BodyDescription> BodySlot::description() const {
    const std::lock_guard lock(mutex_);
    return description_;
}

}  // namespace defrec
