// Where a template keeps its body: what an application says of it, its computation in the
// background, and the body itself from when that is done.
#pragma once
#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>

#include "sdk/body/body.hpp"

namespace defrec {

class Services;

// Any thread.
class BodySlot {
  public:
    // services: whose background thread computes it; where they are gone, who waits does.
    explicit BodySlot(std::weak_ptr<const Services> services);
    // before: of the surface that this one was, whose body serves until this one's is ready.
    explicit BodySlot(std::shared_ptr<const BodySlot> before);
    ~BodySlot();
    BodySlot(const BodySlot&) = delete;
    BodySlot& operator=(const BodySlot&) = delete;

    // Begins to compute the body unless that was done. surface: copied. Never throws: where that
    // fails there is no body.
    void start(const BodySurface& surface) noexcept;
    // Likewise, and waits for it at most so long: DEFREC_OK, DEFREC_TIMEOUT. Throws Error where it
    // cannot be made.
    defrec_status wait(const BodySurface& surface, uint64_t timeout_ns);
    // From now on the body is another one, which is computed at once.
    void describe(std::shared_ptr<const BodyDescription> description, const BodySurface& surface);

    // The same where another surface of the lineage was described: what grew from this one, or what
    // it grew from.
    void follow_lineage(const BodySurface& surface) noexcept;
    // The same without computing it; before anything else is asked.
    void recall(std::shared_ptr<const BodyDescription> description);

    // This surface's, or that of the one before; null: none is ready.
    std::shared_ptr<const Body> body() const;
    // The state of this surface's: DEFREC_BODY_STATE_*.
    uint32_t state() const;
    // null: the application says nothing.
    std::shared_ptr<const BodyDescription> description() const;

  private:
    struct Task;
    std::shared_ptr<Task> queue(const BodySurface& surface,
                                std::shared_ptr<const BodyDescription> description) const;
    std::shared_ptr<Task> begin(const BodySurface& surface);
    void replace(std::shared_ptr<Task> task, std::shared_ptr<const BodyDescription> description,
                 uint64_t generation);
    bool drop() const;
    std::shared_ptr<const BodySlot> before() const;
    void release_old() const;

    // Shared by all surfaces that became of one by growing or by a cut.
    struct Lineage;

    const std::weak_ptr<const Services> services_;
    const std::shared_ptr<Lineage> lineage_;
    std::atomic<uint64_t> generation_;                // of the description
    mutable std::mutex mutex_;                        // of what follows
    mutable std::shared_ptr<const BodySlot> before_;  // until there is a body
    std::shared_ptr<const BodyDescription> description_;
    std::shared_ptr<Task> task_;
    mutable std::shared_ptr<const Body> last_;  // before the description changed
};

}  // namespace defrec
