// What the keys of roads and their laws mean; the rest of their reference is made from the calls that read them.
#include "costate/scene/key_meaning.h"

namespace costate {

namespace {

const KindKeys road_keys("road", {{"kind", "flat, a profile z(x), or a post that moves in time"},
                                  {"height_m", "of a flat road"},
                                  {"law", "of x for a profile, of time for a post"},
                                  {"speed_m_per_s", "of a post: that of the vehicle it stands for"},
                                  {"ramp_s", "of a post: its law grows from zero over this time"},
                                  {"ramp_m", "of a profile: the same over this way"}});

const KindKeys bump_law_keys("law bump",
                             {{"height_m", "of the bump"},
                              {"start_m", "where it begins"},
                              {"length_m", "of the bump"},
                              {"count", "how many"},
                              {"spacing_m", "from one start to the next, length_m at least; of more than one"},
                              {"shape", "cosine is smooth at its ends, half_sine has kinks there"}});

const KindKeys sine_sweep_law_keys("law sine_sweep",
                                   {{"amplitude_m", "half of the swing"},
                                    {"start_m", "where it begins"},
                                    {"length_m", "over which the frequency changes; behind it the last one goes on"},
                                    {"n_start_1_per_m, n_end_1_per_m", "waves by length at its ends"}});

const KindKeys iso8608_law_keys("law iso8608",
                                {{"class", "A (smooth) to H"},
                                 {"roughness_m3", "spectral density at 0.1 waves a metre; stands over 'class'"},
                                 {"n_min_1_per_m, n_max_1_per_m", "band of waves by length"},
                                 {"count", "of sine waves"},
                                 {"seed", "of their phases: the same seed, the same road"}});

const KindKeys noise_law_keys("law noise", {{"exponent", "by which the density falls with the waves"},
                                            {"roughness_m3", "spectral density at 0.1 waves a metre"},
                                            {"n_min_1_per_m, n_max_1_per_m", "band of waves by length"},
                                            {"count", "of sine waves"},
                                            {"seed", "of their phases: the same seed, the same road"}});

const KindKeys profile_table_law_keys("law profile_table", {{"file", "path of a file with x and z, from the scene"},
                                                            {"x_m", "in its place, places"},
                                                            {"z_m", "and heights"},
                                                            {"scale", "of the heights"}});

}  // namespace

}  // namespace costate
