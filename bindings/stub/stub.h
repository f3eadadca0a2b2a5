/* stub.h - what a test of a binding asks of the stub libdefrec, beside the functions of defrec_c.h.
 * scripts/contract/writers/stub.py says what it writes down. */
#ifndef DEFREC_STUB_H
#define DEFREC_STUB_H
#include "include/defrec_c.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The next and all later calls of this function answer so. A function with a status returns it, and
 * where it is negative writes no output, error message being what defrec_last_error says. A count
 * or a version is returned as the number given; a function that returns a text returns the error
 * message. Without an answer: DEFREC_OK, 0, the header's version, and the text "stub". threads: any
 */
DEFREC_API void DEFREC_CALL defrec_stub_answer(const char* function, int32_t status,
                                               const char* message);

/* Every call since this was called last, one a line, and forgets them. Valid until this thread
 * calls it again. threads: any */
DEFREC_API const char* DEFREC_CALL defrec_stub_calls(void);

/* Forgets calls and answers. Handles go on counting: none is given twice. threads: any */
DEFREC_API void DEFREC_CALL defrec_stub_reset(void);

#ifdef __cplusplus
}
#endif
#endif
