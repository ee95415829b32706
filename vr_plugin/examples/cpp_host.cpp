// A host in C++ that embeds Python and shows our volume among its own polygons, without a screen.
//
//   g++ -O2 cpp_host.cpp $(python3-config --includes --embed --ldflags) -lEGL -lOpenGL -o cpp_host
//   PYTHONPATH=site-packages ./cpp_host volume.npy picture.ppm
//
// The program makes its context, its framebuffer with depth and its scene: one polygon in front of the volume's left
// half, one behind all of it. Python gets two matrices and draws into what is bound. Python's C API only; with
// pybind11 the five calls are one line each.

#define PY_SSIZE_T_CLEAN
#include <Python.h>

#define GL_GLEXT_PROTOTYPES
#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <GL/gl.h>
#include <GL/glext.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

static const int WIDTH = 200, HEIGHT = 150;

static void need(bool good, const char *what) {
    if (good) return;
    if (PyErr_Occurred()) PyErr_Print();
    std::fprintf(stderr, "cannot %s\n", what);
    std::exit(1);
}

// ---- The host's own OpenGL -------------------------------------------------------------------------------

static void make_context() {
    auto display_of = (PFNEGLGETPLATFORMDISPLAYEXTPROC)eglGetProcAddress("eglGetPlatformDisplayEXT");
    EGLDisplay display = display_of(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr);
    need(eglInitialize(display, nullptr, nullptr), "open EGL without a screen");
    eglBindAPI(EGL_OPENGL_API);
    const EGLint wanted[] = {EGL_SURFACE_TYPE, 0, EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_NONE};
    EGLConfig config;
    EGLint count = 0;
    eglChooseConfig(display, wanted, &config, 1, &count);
    const EGLint version[] = {EGL_CONTEXT_MAJOR_VERSION, 3, EGL_CONTEXT_MINOR_VERSION, 3, EGL_NONE};
    EGLContext context = eglCreateContext(display, config, EGL_NO_CONTEXT, version);
    need(count && context && eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context), "make a context");
}

static void make_framebuffer() {
    GLuint framebuffer, buffers[2];
    glGenFramebuffers(1, &framebuffer);
    glGenRenderbuffers(2, buffers);
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    const GLenum formats[] = {GL_SRGB8_ALPHA8, GL_DEPTH_COMPONENT24};
    const GLenum places[] = {GL_COLOR_ATTACHMENT0, GL_DEPTH_ATTACHMENT};
    for (int n = 0; n < 2; n++) {
        glBindRenderbuffer(GL_RENDERBUFFER, buffers[n]);
        glRenderbufferStorage(GL_RENDERBUFFER, formats[n], WIDTH, HEIGHT);
        glFramebufferRenderbuffer(GL_FRAMEBUFFER, places[n], GL_RENDERBUFFER, buffers[n]);
    }
    need(glCheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE, "draw into an sRGB picture");
    glViewport(0, 0, WIDTH, HEIGHT);
    glEnable(GL_FRAMEBUFFER_SRGB);
}

static GLuint make_program() {
    const char *sources[] = {
        "#version 330 core\n"
        "uniform vec4 area; uniform float away; uniform mat4 projection;\n"  // left, bottom, right, top; view space
        "void main() { vec2 at = vec2(gl_VertexID & 1, gl_VertexID >> 1);\n"
        "    gl_Position = projection * vec4(mix(area.xy, area.zw, at), -away, 1.0); }",
        "#version 330 core\n"
        "uniform vec3 paint; out vec4 colour; void main() { colour = vec4(paint, 1.0); }"};
    GLuint program = glCreateProgram();
    for (int n = 0; n < 2; n++) {
        GLuint shader = glCreateShader(n ? GL_FRAGMENT_SHADER : GL_VERTEX_SHADER);
        glShaderSource(shader, 1, &sources[n], nullptr);
        glCompileShader(shader);
        glAttachShader(program, shader);
    }
    glLinkProgram(program);
    GLuint nothing;
    glGenVertexArrays(1, &nothing);
    glBindVertexArray(nothing);
    glUseProgram(program);
    return program;
}

static void rectangle(GLuint program, const float (&area)[4], float away, float r, float g, float b) {
    glUniform4fv(glGetUniformLocation(program, "area"), 1, area);
    glUniform1f(glGetUniformLocation(program, "away"), away);
    glUniform3f(glGetUniformLocation(program, "paint"), r, g, b);
    glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
}

// ---- What concerns the volume ----------------------------------------------------------------------------

// 16 numbers as OpenGL takes them, column by column, as the list of rows that Python expects.
static PyObject *rows(const double *columns) {
    PyObject *matrix = PyList_New(4);
    for (int row = 0; row < 4; row++) {
        PyObject *line = PyList_New(4);
        for (int column = 0; column < 4; column++)
            PyList_SetItem(line, column, PyFloat_FromDouble(columns[4 * column + row]));
        PyList_SetItem(matrix, row, line);
    }
    return matrix;
}

// The volume, 1 m large, its middle in the origin of the host's scene.
static const char *SETUP =
    "import numpy as np, persp_sw as psw\n"
    "from vr_plugin.host import HostView, VolumeInHost\n"
    "def plug_in(path):\n"
    "    volume = psw.load(path)\n"
    "    placed = np.eye(4)\n"
    "    placed[:3, :3] /= max(volume.extent)\n"
    "    placed[:3, 3] = -volume.centre / max(volume.extent)\n"
    "    return VolumeInHost(psw.Renderer(volume), placed)\n";

int main(int count, char **arguments) {
    need(count == 3, "go on: give a volume file and the name of a .ppm file");
    make_context();
    make_framebuffer();
    GLuint program = make_program();

    const double near = 0.1, far = 20, slope = 1 / std::tan(0.35), distance = 2.2;
    const double projection[16] = {slope * HEIGHT / WIDTH, 0, 0, 0, 0, slope, 0, 0, 0, 0, -(far + near) / (far - near),
                                   -1, 0, 0, -2 * far * near / (far - near), 0};
    const double view[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, -distance, 1};

    Py_Initialize();
    PyObject *names = PyDict_New();
    PyDict_SetItemString(names, "__builtins__", PyEval_GetBuiltins());
    need(PyRun_String(SETUP, Py_file_input, names, names), "import vr_plugin");
    PyObject *plugin = PyObject_CallFunction(PyDict_GetItemString(names, "plug_in"), "s", arguments[1]);
    need(plugin, "load the volume");
    need(PyObject_CallMethod(plugin, "start", nullptr), "start");
    PyObject *seen = PyObject_CallFunction(PyDict_GetItemString(names, "HostView"), "NN(ii)", rows(projection),
                                           rows(view), WIDTH, HEIGHT);
    need(seen, "make a view");

    // A frame.
    need(PyObject_CallMethod(plugin, "prepare", "[O]", seen), "prepare");
    glClearColor(0.01f, 0.015f, 0.03f, 1);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    glEnable(GL_DEPTH_TEST);
    float matrix[16];
    for (int n = 0; n < 16; n++) matrix[n] = (float)projection[n];
    glUniformMatrix4fv(glGetUniformLocation(program, "projection"), 1, GL_FALSE, matrix);
    rectangle(program, {-0.9f, -0.3f, 0.9f, 0.3f}, (float)distance + 1.2f, 0.5f, 0.03f, 0.02f);
    rectangle(program, {-0.5f, -0.15f, 0.0f, 0.15f}, (float)distance - 0.9f, 0.02f, 0.2f, 0.4f);
    need(PyObject_CallMethod(plugin, "draw", "O", seen), "draw");

    std::vector<unsigned char> pixels(4 * WIDTH * HEIGHT);
    glReadPixels(0, 0, WIDTH, HEIGHT, GL_RGBA, GL_UNSIGNED_BYTE, pixels.data());
    need(PyObject_CallMethod(plugin, "stop", nullptr), "stop");
    need(glGetError() == GL_NO_ERROR, "end without an OpenGL error");

    std::FILE *file = std::fopen(arguments[2], "wb");
    need(file, "write the picture");
    std::fprintf(file, "P6 %d %d 255\n", WIDTH, HEIGHT);
    for (int row = HEIGHT - 1; row >= 0; row--)
        for (int column = 0; column < WIDTH; column++) std::fwrite(&pixels[4 * (row * WIDTH + column)], 1, 3, file);
    std::fclose(file);
    return Py_FinalizeEx() < 0;
}
