// A job that a call reads.
#pragma once
#include <memory>
#include <optional>
#include <shared_mutex>

#include "sdk/api/objects.hpp"

namespace defrec {

// For as long as it lives the job cannot be released.
class JobUse {
  public:
    explicit JobUse(defrec_job handle) : object_(find_handle(handle)), lock_(object_->in_use) {
        if (object_->released) fail(DEFREC_ERROR_HANDLE, "this job was released already");
    }
    Job* operator->() const { return object_->job.get(); }
    const Job& operator*() const { return *object_->job; }
    const std::optional<Eigen::Isometry3d>& camera_pose() const { return object_->camera_pose; }

  private:
    std::shared_ptr<JobObject> object_;
    std::shared_lock<std::shared_mutex> lock_;
};

}  // namespace defrec
