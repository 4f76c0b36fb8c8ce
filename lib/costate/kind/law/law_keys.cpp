// What the keys of laws mean; the rest of their reference is made from the calls that read them.
#include "costate/scene/key_meaning.h"

namespace costate {

namespace {

const KindKeys bump_stop_law_keys("law bump_stop",
                                  {{"gap", "where it begins"},
                                   {"stiffness", "of the stop"},
                                   {"exponent", "of the depth"},
                                   {"smoothing", "width over which the corner is rounded; one of exponent 1 needs it"},
                                   {"side", "on which side of the gap it acts"}});

const KindKeys formula_law_keys("law formula",
                                {{"formula", "in t or x and the names of the law's other keys, all numbers"},
                                 {"a, w, b", "numbers of the formula of the example; any names will do"}});

const KindKeys sum_law_keys("law sum", {{"terms", "laws"}});

const KindKeys product_law_keys("law product", {{"factors", "laws"}});

const KindKeys chirp_law_keys(
    "law chirp", {{"mean", "about which it swings"},
                  {"amplitude", "half of the swing"},
                  {"from, to", "where the frequency is the first and the last one; beyond it goes on changing"},
                  {"first_angular_frequency_rad_per_s, last_angular_frequency_rad_per_s", "the frequency there"},
                  {"phase_rad", "at 'from'"}});

const KindKeys constant_law_keys("law constant", {{"value", "the value"}});

const KindKeys polynomial_law_keys("law polynomial", {{"coefficients", "[c0, c1, ...]"}});

const KindKeys sine_law_keys("law sine", {{"mean", "about which it swings"},
                                          {"amplitude", "half of the swing"},
                                          {"angular_frequency_rad_per_s", "by x, which is mostly time"},
                                          {"phase_rad", "at x = 0"}});

const KindKeys smooth_step_law_keys("law smooth_step", {{"from, to", "where the step begins and ends"},
                                                        {"before, after", "the values there"}});

const KindKeys table_law_keys("law table", {{"x", "places, rising"}, {"y", "values there"}});

const KindKeys piecewise_law_keys("law piecewise",
                                  {{"breaks", "places, rising"},
                                   {"coefficients",
                                    "of a polynomial for each interval, [c0, c1, ...]; continued: behind the first "
                                    "break [c1, c2, ...] by the distance from the break before"},
                                   {"joins",
                                    "what must meet at the breaks: values, slopes too, or nothing; continued: each "
                                    "piece begins where the one before ends"}});

const KindKeys scaled_law_keys("law scaled", {{"slope", "the slope that it is to have"},
                                              {"nominal_slope", "the slope of 'law' that this is compared with"},
                                              {"law", "what is scaled"},
                                              {"reference", "x about which 'law' is scaled"}});

const KindKeys steps_law_keys("law steps", {{"at", "places, rising"},
                                            {"values", "one more than places"},
                                            {"width", "of each step"}});

const KindKeys smooth_steps_law_keys("law smooth_steps", {{"x", "places, rising"}, {"y", "levels there"}});

}  // namespace

}  // namespace costate
