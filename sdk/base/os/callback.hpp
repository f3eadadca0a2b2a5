// The scope of a call into the application. While it lasts, this thread may not call defrec.
#pragma once

namespace defrec {

class CallbackScope {
  public:
    CallbackScope() noexcept { ++depth(); }
    ~CallbackScope() { --depth(); }
    CallbackScope(const CallbackScope&) = delete;
    CallbackScope& operator=(const CallbackScope&) = delete;
    static bool inside() noexcept { return depth() > 0; }

  private:
    static int& depth() noexcept {
        static thread_local int value = 0;
        return value;
    }
};

}  // namespace defrec
