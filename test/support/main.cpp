// The main function of the test programs. In a file of its own, so that the linker leaves it out of a program
// that brings its own.
int run_catch(int argc, char* argv[]);

int main(int argc, char* argv[]) { return run_catch(argc, argv); }
