// The floating point mode of a thread across code that is not ours.
#pragma once
#include <cstdint>
#if defined(__x86_64__)
#include <xmmintrin.h>
#else
#include <cfenv>
#endif

namespace defrec {

// For a scope: rounding, flushing of denormals and which exceptions raise signals are afterwards as
// they were. Costs some nanoseconds where nothing has changed them.
class KeptFloatingPoint {
  public:
    KeptFloatingPoint() noexcept { read(before_); }
    ~KeptFloatingPoint() { restore(); }
    KeptFloatingPoint(const KeptFloatingPoint&) = delete;
    KeptFloatingPoint& operator=(const KeptFloatingPoint&) = delete;

    // Before the end of the scope; whether anything had been changed.
    bool restore() noexcept {
        Mode now;
        read(now);
        if (is_same(now, before_)) return false;
        set(before_);
        ++changes_of_this_thread();
        return true;
    }
    // How often something had been changed.
    static uint64_t changes() noexcept { return changes_of_this_thread(); }

  private:
#if defined(__x86_64__)
    struct Mode {
        uint32_t vectors;
        uint16_t x87;
    };
    static void read(Mode& mode) noexcept {
        mode.vectors = _mm_getcsr();
        asm volatile("fnstcw %0" : "=m"(mode.x87));
    }
    // Apart from the flags of exceptions that have occurred.
    static bool is_same(const Mode& a, const Mode& b) noexcept {
        constexpr uint32_t kFlags = 0x3f;
        return ((a.vectors ^ b.vectors) & ~kFlags) == 0 && a.x87 == b.x87;
    }
    static void set(const Mode& mode) noexcept {
        _mm_setcsr(mode.vectors);
        // A pending exception must not be raised by the next instruction.
        asm volatile("fnclex\n\tfldcw %0" : : "m"(mode.x87));
    }
#elif defined(__aarch64__)
    using Mode = uint64_t;
    static void read(Mode& mode) noexcept { asm volatile("mrs %0, fpcr" : "=r"(mode)); }
    static bool is_same(Mode a, Mode b) noexcept { return a == b; }
    static void set(Mode mode) noexcept { asm volatile("msr fpcr, %0" : : "r"(mode)); }
#else
    struct Mode {
        std::fenv_t environment;
        int rounding;
    };
    static void read(Mode& mode) noexcept {
        std::fegetenv(&mode.environment);
        mode.rounding = std::fegetround();
    }
    static bool is_same(const Mode& a, const Mode& b) noexcept { return a.rounding == b.rounding; }
    static void set(const Mode& mode) noexcept { std::fesetenv(&mode.environment); }
#endif
    static uint64_t& changes_of_this_thread() noexcept {
        thread_local uint64_t count = 0;
        return count;
    }

    Mode before_;
};

}  // namespace defrec
