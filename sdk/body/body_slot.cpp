// See body_slot.hpp.
#include "sdk/body/body_slot.hpp"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <new>
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
        {
            const std::lock_guard lock(mutex);
            if (has_begun) return;
            has_begun = true;
            if (!is_wanted) return end();
        }
        std::shared_ptr<const Body> made;
        defrec_status result = DEFREC_OK;
        const char* text = "";
        try {
            static const BodyDescription kNothingKnown;
            made = Body::make({vertices, piece, pieces, cuts},
                              description != nullptr ? *description : kNothingKnown,
                              [this] { return is_wanted.load(); });
        } catch (const Error& error) {
            result = error.status();
            text = "no body can be made of this surface";
        } catch (const std::exception&) {
            result = DEFREC_ERROR_OUT_OF_MEMORY;
            text = "out of memory";
        }
        body = std::move(made);
        status = result;
        reason = text;
        const std::lock_guard lock(mutex);
        end();
    }
    // Under the mutex.
    void end() {
        is_done = true;
        changed.notify_all();
    }
    // Not wanted any more, unless it has begun.
    void drop() {
        const std::lock_guard lock(mutex);
        if (!has_begun) is_wanted = false;
    }

    const std::vector<defrec_surface_point> vertices;
    const std::vector<uint8_t> piece;
    const size_t pieces;
    const std::vector<defrec_cut_point> cuts;
    const std::shared_ptr<const BodyDescription> description;
    std::atomic<bool> is_wanted{true};

    std::mutex mutex;  // of has_begun, and to wait
    std::condition_variable changed;
    bool has_begun = false;
    // From then on what follows stays: no frame waits for a thread that hardly ever runs.
    std::atomic<bool> is_done{false};
    std::shared_ptr<const Body> body;
    defrec_status status = DEFREC_OK;
    const char* reason = "";
};

BodySlot::BodySlot(std::weak_ptr<const Services> services) : services_(std::move(services)) {}

BodySlot::BodySlot(std::shared_ptr<const BodySlot> before)
    : services_(before->services_),
      before_(std::move(before)),
      description_(before_->description()) {}

BodySlot::~BodySlot() {
    if (task_ != nullptr) task_->is_wanted = false;
}

// Under the mutex.
std::shared_ptr<BodySlot::Task> BodySlot::begin(const BodySurface& surface) {
    if (task_ != nullptr) return task_;
    auto task = std::make_shared<Task>(surface, description_);
    if (const std::shared_ptr<const Services> services = services_.lock())
        services->background().add([task] { task->run(); });
    task_ = task;
    return task;
}

void BodySlot::start(const BodySurface& surface) noexcept {
    try {
        const std::lock_guard lock(mutex_);
        begin(surface);
        // A surface that grows faster than bodies are computed goes without some of them.
        if (before_ != nullptr) before_->drop();
    } catch (const std::exception&) {
        // Without a body deep points move as before there is one.
    }
}

void BodySlot::drop() const {
    const std::lock_guard lock(mutex_);
    if (task_ != nullptr) task_->drop();
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
            const defrec_status status = task->status;
            lock.unlock();
            // Who waits next begins again where it was dropped or memory ran out.
            if (status == DEFREC_OK || status == DEFREC_ERROR_OUT_OF_MEMORY) {
                const std::lock_guard own(mutex_);
                if (task_ == task) task_.reset();
            }
            if (status < 0) fail(status, task->reason);
        } else if (Clock::now() >= end) {
            return DEFREC_TIMEOUT;
        }
    }
}

void BodySlot::describe(std::shared_ptr<const BodyDescription> description,
                        const BodySurface& surface) {
    const std::shared_ptr<const Body> usable = body();
    const std::lock_guard lock(mutex_);
    last_ = usable;
    if (task_ != nullptr) task_->is_wanted = false;
    task_.reset();
    description_ = std::move(description);
    begin(surface);
}

void BodySlot::recall(std::shared_ptr<const BodyDescription> description) {
    const std::lock_guard lock(mutex_);
    description_ = std::move(description);
}

std::shared_ptr<const Body> BodySlot::body() const {
    std::shared_ptr<const BodySlot> before;
    std::shared_ptr<const Body> last;
    {
        const std::lock_guard lock(mutex_);
        if (task_ != nullptr && task_->is_done && task_->body != nullptr) {
            before_.reset();
            return task_->body;
        }
        if (last_ != nullptr) return last_;
        before = before_;
    }
    return before != nullptr ? before->body() : nullptr;
}

uint32_t BodySlot::state() const {
    const std::lock_guard lock(mutex_);
    if (task_ == nullptr) return DEFREC_BODY_STATE_NONE;
    if (!task_->is_done) return DEFREC_BODY_STATE_PENDING;
    return task_->body != nullptr ? DEFREC_BODY_STATE_READY : DEFREC_BODY_STATE_NONE;
}

std::shared_ptr<const BodyDescription> BodySlot::description() const {
    const std::lock_guard lock(mutex_);
    return description_;
}

}  // namespace defrec
