// What the keys of costs mean; the rest of their reference is made from the calls that read them.
#include "costate/scene/key_meaning.h"

namespace costate {

namespace {

const std::vector<KeyMeaning> meanings = {{"output", "name of an output: costate list SCENE"},
                                          {"weight", "factor of the term, or a law of time for it"},
                                          {"target", "a number, a law of time, or \"output:NAME\""},
                                          {"target_output", "name of an output, in the place of 'target'"}};

const KindKeys square("cost square", meanings, "output = \"plate.x\"\nweight = 2\ntarget = 0.5");
const KindKeys value("cost value", meanings, "output = \"plate.angle\"");

}  // namespace

}  // namespace costate
