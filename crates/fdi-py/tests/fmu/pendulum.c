/* A pendulum on a torque motor as a co-simulation FMU of FMI 2.0, for tests alone. Functions that the
   tests do not call answer that they cannot. */
#include <math.h>
#include <stdlib.h>

enum { INERTIA, DRAG, COMMAND, LOAD, ANGLE, SPEED, TORQUE, COUNT };
#define INNER_STEPS 10

static const double start[COUNT] = {0.02, 0.02, 0, 0, 0, 0, 0};

const char *fmi2GetTypesPlatform(void) { return "default"; }
const char *fmi2GetVersion(void) { return "2.0"; }

void *fmi2Instantiate(const char *name, int type, const char *guid, const char *place, const void *calls,
                      int visible, int logging) {
    (void)name, (void)type, (void)guid, (void)place, (void)calls, (void)visible, (void)logging;
    double *values = malloc(sizeof start);
    for (int n = 0; values && n < COUNT; n++) values[n] = start[n];
    return values;
}
void fmi2FreeInstance(void *one) { free(one); }

int fmi2GetReal(void *one, const unsigned *at, size_t count, double *to) {
    for (size_t n = 0; n < count; n++) to[n] = ((double *)one)[at[n]];
    return 0;
}
int fmi2SetReal(void *one, const unsigned *at, size_t count, const double *from) {
    for (size_t n = 0; n < count; n++) ((double *)one)[at[n]] = from[n];
    return 0;
}

int fmi2DoStep(void *one, double time, double step, int keep) {
    double *x = one, inner = step / INNER_STEPS;
    (void)time, (void)keep;
    x[TORQUE] = 8 * (x[COMMAND] - x[ANGLE]) - 0.4 * x[SPEED];
    for (int n = 0; n < INNER_STEPS; n++) {
        double own = x[DRAG] * x[SPEED] + 0.5 * sin(x[ANGLE]) + x[LOAD];
        x[SPEED] += inner * (x[TORQUE] - own) / x[INERTIA];
        x[ANGLE] += inner * x[SPEED];
    }
    return 0;
}

#define DONE(name) int name(void) { return 0; }
#define CANNOT(name) int name(void) { return 3; }
DONE(fmi2SetDebugLogging)
DONE(fmi2SetupExperiment)
DONE(fmi2EnterInitializationMode)
DONE(fmi2ExitInitializationMode)
DONE(fmi2Terminate)
DONE(fmi2Reset)
CANNOT(fmi2GetInteger)
CANNOT(fmi2GetBoolean)
CANNOT(fmi2GetString)
CANNOT(fmi2SetInteger)
CANNOT(fmi2SetBoolean)
CANNOT(fmi2SetString)
CANNOT(fmi2GetFMUstate)
CANNOT(fmi2SetFMUstate)
CANNOT(fmi2FreeFMUstate)
CANNOT(fmi2SerializedFMUstateSize)
CANNOT(fmi2SerializeFMUstate)
CANNOT(fmi2DeSerializeFMUstate)
CANNOT(fmi2GetDirectionalDerivative)
CANNOT(fmi2SetRealInputDerivatives)
CANNOT(fmi2GetRealOutputDerivatives)
CANNOT(fmi2CancelStep)
CANNOT(fmi2GetStatus)
CANNOT(fmi2GetRealStatus)
CANNOT(fmi2GetIntegerStatus)
CANNOT(fmi2GetBooleanStatus)
CANNOT(fmi2GetStringStatus)
